"""Teaching: the page of postures, data sets of postures and priors."""
