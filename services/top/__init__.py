"""A live table of the network: every service of one rig or several."""
