"""The recogniser: joint angles as symbols, a hidden Markov model for each posture.  [Two-view 5]"""
