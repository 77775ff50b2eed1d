"""Problem -> smooth NLP by factors -> IPOPT -> polish."""
