"""Training of posture models.  [Two-view 5.1]"""
