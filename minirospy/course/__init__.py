"""Checks students' programs: `minirospy check EXERCISE` runs a program with a new master and a new virtual board.

``exercise.py`` reads an exercise's YAML file. ``world.py`` provides the master, the board and the programs, ``stimuli.py`` acts
on them, and ``expectations.py`` observes them. ``checker.py`` performs an exercise's steps in order. ``results.py`` stores the
results of this computer and sends them to the teacher's master. ``exercises/`` contains the exercises of the course.
"""
