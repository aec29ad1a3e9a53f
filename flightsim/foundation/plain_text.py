"""Texts that a vehicle sent, as they may be shown."""


def plain_text(text: str) -> str:
    """A text in one line of printable characters; all others are shown as escapes (`\\x1b`).

    A terminal would execute control characters: they move the cursor, rename the window, or overwrite the
    question that is asked. Characters that turn the direction of writing are escaped too.
    """
    if text.isprintable():
        return text
    return "".join(
        character
        if character.isprintable()
        else " "
        if character == "\t"
        else character.encode("unicode_escape").decode("ascii")
        for character in text
    )
