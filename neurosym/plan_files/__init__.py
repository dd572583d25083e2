"""plan.json: a problem, its plan and what the search did, written and read back."""
