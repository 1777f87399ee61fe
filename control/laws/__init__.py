"""The laws that say in which direction the ball goes, and the form that every law has, also one of your own."""
