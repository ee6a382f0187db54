"""The machine file: YAML, checked key by key, and the plain `Setup` it becomes.

The only place that knows pydantic or yaml. `yaml_tree` reads the text and remembers where everything
stood; `models` says which keys there are; `complaints` puts what they refuse at its place; `machine_file`
makes the values, `dump` writes them back.
"""
