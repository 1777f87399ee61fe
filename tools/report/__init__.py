"""What a log looks like to people: series, figures, words, one page."""
