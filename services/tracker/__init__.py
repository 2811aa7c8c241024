"""The hybrid tracker: calibrated views, a learnt motion prior, particles refined by force and moment.  [Hybrid]"""
