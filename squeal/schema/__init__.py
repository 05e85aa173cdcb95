"""What values may be: one table of keys that reads, checks and documents files and records.

Our own, not pydantic's or msgspec's: a line of it also holds unit, models and the words of a
refusal, serves arrays and dual numbers, and loads in no time.
"""
