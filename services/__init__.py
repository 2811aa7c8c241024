"""The zenocap services, one folder each, and the command line."""

import os

# Matrices here are small: several threads for each would wait for one another, on a busy machine for seconds.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is first imported
