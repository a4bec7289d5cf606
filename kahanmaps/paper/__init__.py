"""The paper of Petrera and Suris: every claim as a short function, and their verification."""
