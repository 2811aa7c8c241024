"""`zenocap posture`: train, evaluate, label and show posture models."""
