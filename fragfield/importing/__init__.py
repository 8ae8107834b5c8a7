"""Tables of tests as people have them: `fragfield import`.

    file -> sheet (cells with their lines) -> columns (names, units, decimal sign) -> table in SI, as a case reads it

What would change a number by a factor is never concluded but asked: `QuestionError` names the option that answers it.
"""
