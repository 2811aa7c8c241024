"""The page on which postures are labelled in takes, trained and tried."""
