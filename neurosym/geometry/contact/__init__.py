"""Where two bodies touch, and how deep they overlap at rest. FCL is spoken to in `collision`."""
