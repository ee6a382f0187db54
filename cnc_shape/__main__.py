"""``python -m cnc_shape`` is the command line."""

from cnc_shape.cli import main

if __name__ == "__main__":
    main()
