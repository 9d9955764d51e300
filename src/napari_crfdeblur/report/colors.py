"""Colors that the color-blind can tell apart, and that print (Okabe & Ito 2008)."""

GROUPS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9")
OTHERS = "#333333"
REJECTED = "#d62728"
CHANNELS = ("#d55e00", "#009e73", "#0072b2")
ONE = "#0072b2"
REFERENCES = ("#555555", "#aaaaaa", "#cc79a7")
COVERED = "#e4ecf3"
INK, PALE = "#222222", "#6b6b6b"
