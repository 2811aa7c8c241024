"""Videos that began at different times, cameras that are late, and videos as strangers have them."""
