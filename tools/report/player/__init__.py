"""The push played from above: its course as data for a page, and the script that plays it."""
