"""``florence doctor``: looks at everything a robot needs and says what to do about each problem.

Each module looks at one thing and returns findings; none of them changes anything, raises because of what it
finds, or waits without a limit.
"""
