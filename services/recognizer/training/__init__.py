"""Training of posture models: examples, hidden Markov models, thresholds and cross-validation.  [Two-view 5.1]"""
