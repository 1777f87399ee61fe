"""The figures of a run: drawn with matplotlib, written as SVG for pages and as PNG for papers and chats."""
