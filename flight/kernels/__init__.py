"""Compiled inner loops. Imported only when something is flown, so that `import flight` stays quick."""
