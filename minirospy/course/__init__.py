"""Checks of students' programs: `minirospy check EXERCISE` runs a program on a new master and a new virtual board.

``exercise.py`` reads an exercise's YAML file, ``world.py`` has the master, the board and the programs, ``stimuli.py`` acts on
them, ``expectations.py`` observes them, ``checker.py`` performs an exercise's steps in order, and ``results.py`` stores what this
computer has passed and sends it to the teacher's master. ``exercises/`` has the exercises of the course.
"""
