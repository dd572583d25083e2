"""Everything that makes tables for the paper: comparisons, studies, their journals and reports."""
