"""Maps over finite fields: the lengths of their cycles."""
