"""The paper of Petrera and Suris: every claim a short function, put to the test."""
