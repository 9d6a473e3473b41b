"""What a screen reader is told of widgets and panels that do not say it themselves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bokeh.models import CustomJS, Model, Slider, TextInput

#: Names and states of what can be reached by Tab; Bokeh draws some of it anew, so this runs again.
_TELL = """
const view_of = (model) => Bokeh.index.find_one_by_id(model.id)
const within = (model, selector) => [...(view_of(model)?.shadow_el?.querySelectorAll(selector) ?? [])]
sliders.forEach((slider, i) => {
    for (const handle of within(slider, ".noUi-handle")) {
        handle.setAttribute("aria-label", slider.title)
        handle.setAttribute("aria-valuetext", fields[i]?.value ?? `${slider.value}`)
    }
})
groups.forEach((group, i) => {
    const buttons = within(group, "button")
    buttons.forEach((button, k) => {
        const pressed = buttons.length > 1 ? group.active === k : group.active === true
        button.setAttribute("aria-pressed", `${pressed}`)
        button.parentElement.setAttribute("role", "group")
        button.parentElement.setAttribute("aria-label", group_names[i])
    })
})
figures.forEach((figure, i) => {
    const element = view_of(figure)?.canvas_view?.events_el
    element?.setAttribute("role", "img")
    element?.setAttribute("aria-label", figure_names[i])
})
"""


def spoken(
    sliders: Mapping[Slider, TextInput | None], groups: Mapping[Model, str], figures: Mapping[str, Model]
) -> CustomJS:
    """Return what names sliders, buttons that stay pressed, and figures.

    Parameters
    ----------
    sliders : mapping
        With the field beside each, which shows its value, or None.
    groups : mapping
        Groups of buttons, or single ones that stay pressed, with their names.
    figures : mapping
        By their names.
    """
    args: dict[str, Sequence[object]] = {
        "sliders": list(sliders),
        "fields": list(sliders.values()),
        "groups": list(groups),
        "group_names": list(groups.values()),
        "figures": list(figures.values()),
        "figure_names": list(figures),
    }
    return CustomJS(args=args, code=_TELL)
