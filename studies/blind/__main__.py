"""Run the study of device tests."""

from .study import main, share_from

if __name__ == "__main__":
    help_text = "Diagnose blind device tests and print how often the causes are found."
    main(share_from("studies.blind", help_text))
