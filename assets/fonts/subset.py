"""Makes the subset fonts of this folder from Debian's fonts-inter and fonts-dejavu-core.

    apt-get install fonts-inter fonts-dejavu-core && pip install fonttools && python3 subset.py
"""

import io

from fontTools import subset
from fontTools.pens.cu2quPen import Cu2QuPen
from fontTools.pens.ttGlyphPen import TTGlyphPen
from fontTools.ttLib import TTFont, newTable
from fontTools.ttLib.scaleUpem import scale_upem

INTER = "/usr/share/fonts/opentype/inter/Inter-{}.otf"
DEJAVU = "/usr/share/fonts/truetype/dejavu/DejaVuSansMono{}.ttf"
SOURCES = {
    "Inter-Regular.ttf": INTER.format("Regular"),
    "Inter-SemiBold.ttf": INTER.format("SemiBold"),
    "Inter-Bold.ttf": INTER.format("Bold"),
    "DejaVuSansMono.ttf": DEJAVU.format(""),
    "DejaVuSansMono-Bold.ttf": DEJAVU.format("-Bold"),
}
# ASCII, Latin-1, Latin Extended-A, four Romanian letters, quotes, dashes and the signs that reports print.
UNICODES = [*range(0x20, 0x7F), *range(0xA0, 0x180), *range(0x218, 0x21C), 0x394, 0x3C3, 0x3BC, 0x2009, 0x2013, 0x2014,
            0x2018, 0x2019, 0x201C, 0x201D, 0x201E, 0x2026, 0x2212, 0x2264, 0x2265]


def cubic_to_quadratic(font):
    """Turns CFF outlines into TrueType ones, to half a thousandth of an em."""
    font.recalcBBoxes = True
    glyphs = font.getGlyphSet()
    table = newTable("glyf")
    table.glyphOrder = font.getGlyphOrder()
    table.glyphs = {}
    for name in table.glyphOrder:
        pen = TTGlyphPen(None)
        glyphs[name].draw(Cu2QuPen(pen, 0.0005 * font["head"].unitsPerEm, reverse_direction=True))
        table.glyphs[name] = pen.glyph()
    del font["CFF "]
    font["glyf"], font["loca"] = table, newTable("loca")
    font["maxp"].tableVersion = 0x00010000
    for field in ("maxZones", "maxTwilightPoints", "maxStorage", "maxFunctionDefs", "maxInstructionDefs",
                  "maxStackElements", "maxSizeOfInstructions", "maxComponentElements"):
        setattr(font["maxp"], field, 1 if field == "maxZones" else 0)
    font["post"].formatType = 3.0
    font.sfntVersion = "\000\001\000\000"


for target, source in SOURCES.items():
    options = subset.Options(layout_features=[], hinting=False, drop_tables=["FFTM", "GDEF", "GPOS", "GSUB", "kern"],
                             name_IDs=[0, 1, 2, 3, 4, 5, 6, 13, 14], notdef_outline=True, recalc_timestamp=False)
    font = subset.load_font(source, options)
    chooser = subset.Subsetter(options)
    chooser.populate(unicodes=UNICODES)
    chooser.subset(font)
    if "CFF " in font:
        cubic_to_quadratic(font)
    file = io.BytesIO()
    font.save(file)  # computes the boxes of the new outlines
    font = TTFont(file, recalcTimestamp=False)
    scale_upem(font, 1000)  # PDF widths are thousandths of an em: now they are exact
    font.save(target)
