"""Run the study of device tests."""

from .study import main, share_from

if __name__ == "__main__":
    main(share_from("Diagnose blind device tests and print how often the causes are found."))
