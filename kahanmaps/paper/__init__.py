"""The paper of Petrera and Suris, statement by statement: every claim a short function, every verdict with its reason."""
