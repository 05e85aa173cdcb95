"""`python -m squeal` is the command line."""

import sys

from squeal.cli import main

sys.exit(main())
