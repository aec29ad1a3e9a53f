"""What becomes of an estimator's run: errors against references, as figures, as a table and as a picture."""

from estimators.reports.summary import Assessment, assess, notes_of, table_lines, warnings_of

__all__ = ["Assessment", "assess", "notes_of", "table_lines", "warnings_of"]
