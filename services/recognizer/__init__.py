"""Posture recognition: joint angles as symbols, one hidden Markov model per posture.  [Two-view 5]"""
