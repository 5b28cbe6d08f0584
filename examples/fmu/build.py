"""Makes tanks.fmu of tanks.py. Needs pythonfmu, and no compiler:

pip install pythonfmu
python3 build.py
"""

from pathlib import Path

from pythonfmu.builder import FmuBuilder

if __name__ == "__main__":
    here = Path(__file__).resolve().parent
    # The file is named after the class; the study asks for it in small letters.
    FmuBuilder.build_FMU(here / "tanks.py", dest=here)
    (here / "Tanks.fmu").replace(here / "tanks.fmu")
