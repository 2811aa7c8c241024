"""The guided set-up of a rig on one machine: which steps are done, and the files they leave."""
