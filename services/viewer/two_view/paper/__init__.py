"""Two-view estimation as printed, with cited corrections.  [Two-view 2.4, 3.1-3.5]"""
