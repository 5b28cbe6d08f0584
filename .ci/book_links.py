"""Follows the links of the book: `python3 .ci/book_links.py target/book`.

Pages link to files outside docs/ (examples, sources). mdBook writes `.html` for every `.md`; where no page of the book is meant, the link is
set back to the file, and the file is put beside the book. Exit code 1 where a link or its heading is nowhere.
"""

import re
import shutil
import sys
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[1]
LINK = re.compile(r'(?P<before>(?:href|src)=")(?P<target>[^"]+)(?P<after>")')
ID = re.compile(r'\bid="([^"]+)"')


def outside(book: Path, target: Path) -> bool:
    """Puts a file or folder of the repository beside the book; whether there is one."""
    source = ROOT / target.relative_to(book)
    if source.is_dir():
        for readme in source.glob("README.md"):
            target.mkdir(parents=True, exist_ok=True)
            shutil.copy(readme, target / "README.md")
        return True
    if not source.is_file():
        return False
    target.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, target)
    return True


def main(book: Path) -> int:
    pages = {page: page.read_text(encoding="utf-8") for page in sorted((book / "docs").rglob("*.html"))}
    names = {page: set(ID.findall(text)) for page, text in pages.items()}
    lost, followed = [], 0

    def resolved(page: Path, link: str) -> str:
        nonlocal followed
        if "://" in link or link.startswith(("data:", "mailto:", "javascript:")):
            return link
        file, _, heading = link.partition("#")
        target = (page.parent / unquote(file)).resolve() if file else page
        followed += 1
        if target.suffix == ".html" and not target.exists() and outside(book, target.with_suffix(".md")):
            return link.replace(".html", ".md", 1)
        if not target.exists() and not (book in target.parents and outside(book, target)):
            lost.append(f"{page.relative_to(book)}: {link}")
        elif heading and target in names and unquote(heading) not in names[target] and page.name not in ("print.html", "404.html"):
            lost.append(f"{page.relative_to(book)}: {link}: no such heading")
        return link

    for page, text in pages.items():
        if page.name in ("404.html", "toc.html"):
            continue
        fixed = LINK.sub(lambda found: found["before"] + resolved(page, found["target"]) + found["after"], text)
        page.write_text(fixed, encoding="utf-8")
    print(f"{len(pages)} pages, {followed} links")
    for line in lost:
        print(line, file=sys.stderr)
    return 1 if lost or followed < 500 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
