"""The claims of the paper of Petrera and Suris, each as a short function, and their verification."""
