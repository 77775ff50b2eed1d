from .conversion import convert as convert, converted_file as converted_file
from .describing import describe as describe
from .description import Description as Description, Word as Word, Words as Words
from .examples import (
    SCHEMA_FILE as SCHEMA_FILE, TEMPLATES as TEMPLATES, companions as companions, example as example,
    examples as examples, new_problem as new_problem, schema_text as schema_text,
)
from .problem_text import exact_value as exact_value, toml_key as toml_key, toml_text as toml_text
from .schema import schema as schema
