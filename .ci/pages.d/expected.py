"""What is expected of every page, and the word for where one is not so."""

# Sizes of the window, px.
WIDE, PHONE = (1400, 1000), (420, 900)
CONTRAST = 4.5


def check(is_so, why):
    if not is_so:
        raise AssertionError(why)
