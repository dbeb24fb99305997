"""`python -m minirospy`: the same as the command `minirospy`."""

import sys

from minirospy.cli.main import main

sys.exit(main())
