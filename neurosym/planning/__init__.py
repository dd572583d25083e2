"""What a planner is given and gives back: budgets, priors, results, validation, explanations, plan files."""
