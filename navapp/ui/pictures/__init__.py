"""Pictures on the operator's screen: real ones where the terminal draws them, else half blocks."""
