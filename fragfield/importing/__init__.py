"""Tables of tests as people have them: `fragfield import`.

    file -> sheet (cells, lines) -> layout (header, units, rows) -> columns in SI -> a file that a case reads

Every conclusion about a file is kept with its reason. What would change a number by a factor is never concluded but
asked: `QuestionError` names the option that answers it.
"""
