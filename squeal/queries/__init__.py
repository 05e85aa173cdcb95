"""The verbs: one file each, in which pads and systems are answered."""
