"""Sizes of the page, and its style sheets; colours and dashes are those of `peel_opt.plots.style`."""

from __future__ import annotations

INK, FAINT, PAPER, REFUSED = "#1A1A1A", "#5A5A5A", "#FFFFFF", "#8C2D04"

#: Width of the controls beside the panels; a panel's frame as it is laid out first, the room left of it
#: for labels (less on a narrow page), and that right of it [pixels].
SIDE, FRAME_WIDTH, FRAME_HEIGHT, LEFT, NARROW_LEFT, RIGHT = 272, 398, 234, 76, 62, 14

#: Widths of the window [pixels] from which panels stand two in a row, and controls beside them.
TWO_COLUMNS, BESIDE = 700, 1100

FONT = "13px"

#: Smallest side of what a finger has to hit [pixels].
TOUCH = 40


GLOBAL = """
html { overflow-y: scroll; }
body { margin: 0; background: #FFFFFF; font-family: system-ui, "DejaVu Sans", Arial, sans-serif; }
"""

#: Within the widgets: sizes that a projector shows, a focus that the keyboard shows, room for fingers.
WIDGETS = f"""
:host {{ font-size: 13px; color: {INK}; }}
.bk-input-group {{ font-size: 13px; }}
.bk-btn {{ font-size: 12.5px; padding: 3px 6px; }}
.bk-btn.bk-active {{ background: #1F4E79; color: #FFFFFF; border-color: #1F4E79; }}
.bk-input {{ font-size: 12.5px; height: 26px; padding: 2px 4px; }}
:host(.refused) .bk-input {{ border: 2px solid {REFUSED}; }}
.bk-slider-title {{ font-size: 13px; }}
:focus-visible {{ outline: 3px solid #E69F00; outline-offset: 1px; }}
@media (pointer: coarse), (max-width: {BESIDE - 1}px) {{
  .bk-btn, .bk-input {{ min-height: {TOUCH}px; height: {TOUCH}px; font-size: 14px; box-sizing: border-box; }}
  .bk-slider-title {{ margin-bottom: 16px; }}
  .noUi-target {{ margin-bottom: 16px; }}
  .noUi-horizontal .noUi-handle {{
    width: {TOUCH}px; height: {TOUCH}px; right: -{TOUCH // 2}px; top: calc(50% - {TOUCH // 2}px);
    background: none; border: none; box-shadow: none;
  }}
  .noUi-horizontal .noUi-handle::before {{ display: none; }}
  .noUi-horizontal .noUi-handle::after {{
    display: block; left: 8px; top: 8px; width: 22px; height: 22px; border-radius: 13px;
    background: #FFFFFF; border: 1px solid #8A8A8A;
  }}
}}
"""

#: The page: controls beside the panels where there is room, above them where there is not.
PAGE = f"""
:host {{
  display: grid !important; width: 100% !important; box-sizing: border-box;
  gap: 6px; padding: 4px; margin: 0 !important;
  grid-template-columns: {SIDE}px minmax(0, 1fr);
  grid-template-rows: auto auto 1fr;
  grid-template-areas: "header header" "controls main" "trust main";
}}
@media (max-width: {BESIDE - 1}px) {{
  :host {{ grid-template-columns: minmax(0, 1fr); grid-template-rows: none;
    grid-template-areas: "header" "controls" "main" "trust"; }}
}}
"""

#: The controls: one below the other, or in two columns above the panels.
CONTROLS = f"""
:host {{ grid-area: controls; width: auto !important; }}
@media (min-width: {TWO_COLUMNS}px) and (max-width: {BESIDE - 1}px) {{
  :host {{ display: grid !important; grid-template-columns: repeat(2, minmax(0, 1fr)); column-gap: 16px; }}
}}
"""

MAIN = ":host { grid-area: main; width: auto !important; min-width: 0; }"
TRUST = ":host { grid-area: trust; width: auto !important; align-self: start; }"

#: The panels: two in a row with their axes in line, or one.
PANELS = f"""
:host {{
  display: grid !important; grid-template-columns: repeat(2, max-content); gap: 6px 0; align-items: end;
}}
@media (max-width: {TWO_COLUMNS - 1}px) {{ :host {{ grid-template-columns: max-content; }} }}
"""

HEADER = f"""
:host {{ grid-area: header; width: auto !important; color: {INK}; font-size: {FONT}; }}
h1 {{ font-size: 20px; margin: 0 14px 0 0; display: inline; }}
p {{ display: inline; color: {FAINT}; line-height: 1.35; }}
summary {{ cursor: pointer; padding: 3px 0; color: #1F4E79; }}
summary:focus-visible {{ outline: 3px solid #E69F00; outline-offset: 1px; }}
dl {{
  display: grid; grid-template-columns: repeat(auto-fill, minmax(min(300px, 100%), 1fr)); margin: 2px 0 6px;
}}
dl div {{ display: flex; gap: 8px; }}
dt {{ font-weight: bold; width: 14px; }}
dd {{ margin: 0; }}
@media (pointer: coarse), (max-width: {BESIDE - 1}px) {{
  p {{ display: block; margin: 2px 0; }}
  summary {{ min-height: {TOUCH}px; line-height: {TOUCH}px; padding: 0; }}
}}
"""

#: Under a panel, as wide as its frame; two lines, so that panels in a row stay in line.
CAPTION = f"""
:host {{
  width: auto !important; contain: inline-size; box-sizing: border-box; min-height: 34px;
  margin: 0 {RIGHT}px 4px {NARROW_LEFT}px !important; font-size: 12px; line-height: 1.3; color: {FAINT};
}}
"""

#: The player of a film, in the colour of a screen that is on.
PLAYER = f"""
:host {{
  background: #FFF6E0; border-radius: 6px; padding: 4px 8px; box-sizing: border-box; align-items: end;
}}
@media (max-width: {TWO_COLUMNS - 1}px) {{
  :host {{ flex-wrap: wrap; justify-content: space-between; }}
  .bk-Slider {{ flex: 1 1 100%; order: 3; }}
}}
"""

#: What is computed now: a line that is always there, whose words come late enough not to flicker.
PROGRESS = f"""
:host {{ min-height: 20px; margin: 0 0 0 5px !important; color: {FAINT}; }}
.doing {{ opacity: 0; animation: appear 0.2s 0.5s forwards; }}
.doing::before {{
  content: ""; display: inline-block; width: 9px; height: 9px; margin-right: 7px; border-radius: 50%;
  border: 2px solid #E69F00; border-top-color: transparent; animation: turn 1s linear infinite;
}}
progress {{ width: 180px; accent-color: #E69F00; vertical-align: middle; }}
@keyframes appear {{ to {{ opacity: 1; }} }}
@keyframes turn {{ to {{ transform: rotate(360deg); }} }}
@media (prefers-reduced-motion: reduce) {{ .doing::before {{ animation: none; }} }}
"""

#: As wide as the device, not as wide as a desk.
VIEWPORT = '<meta name="viewport" content="width=device-width, initial-scale=1">'
