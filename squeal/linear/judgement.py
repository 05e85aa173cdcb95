"""Kept until all import `squeal.linear.verdict`."""

from squeal.linear.verdict import Judgement, judge, judge_reduced, verdict

__all__ = ["Judgement", "judge", "judge_reduced", "verdict"]
