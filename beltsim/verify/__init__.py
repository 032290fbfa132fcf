"""The verification book: analytic and published targets, what the solver makes of them, and the page that says so."""
