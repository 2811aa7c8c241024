"""The estimation of the two-view paper as printed, with the corrections that each place cites.  [Two-view 2.4, 3.1-3.5]"""
