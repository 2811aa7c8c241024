"""The guided set-up of a rig: which steps are done, and the files they leave."""
