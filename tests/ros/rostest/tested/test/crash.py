#!/usr/bin/env python3
import sys

print("last words")
sys.exit(7)
