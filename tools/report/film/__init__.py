"""Pushes as a film, from above: frames drawn with matplotlib, written as GIF or MP4."""
