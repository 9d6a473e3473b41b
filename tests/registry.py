"""Reference problems: questions with answers known to many digits, tagged by what makes them hard.

The values were computed by shooting from the tip (``oracle.py``) and confirmed by a second integrator; the
slow tests of ``test_oracle.py`` regenerate every one of them.
"""

from __future__ import annotations

from dataclasses import dataclass

_TWO = "tip shooting, DOP853 at rtol 1e-13, confirmed by a 30-digit Taylor integrator"
_ONE = "tip shooting, DOP853 at rtol 1e-13, confirmed at rtol 1e-12 and 3e-14"


@dataclass(frozen=True)
class Reference:
    """A question and its answer.

    Parameters
    ----------
    name : str
    question : dict
        A rod's ``ratio`` = eta/y0 and one of ``pressure_ratio`` = p/T0, ``length_ratio`` = sbar/eta, or the
        paper's groups ``beta0`` and ``lam`` or ``beta1``; ``law``; ``state`` where it is not the default;
        for a fold its ``kind`` instead of the given number.
    expected : dict
        What is to be found, with ``tip_angle`` = theta(0) [rad] and ``tip_height`` = y(0)/y0 (in groups
        y(0)/sbar, ``tip_height_hat``).
    tolerance : float
        Absolute error the expected values may have.
    tags : frozenset of str
    source : str
    """

    name: str
    question: dict[str, float | str]
    expected: dict[str, float]
    tolerance: float
    tags: frozenset[str]
    source: str = _TWO

    def __str__(self) -> str:
        return self.name


#: Unfolded states under law (8): ratio, p/T0, sbar/eta, tip angle.
_UNFOLDED = (
    (0.4, 0.4826, 3.5385156997077, -1.76695190318247),
    (0.4, 0.6, 3.36079787674417, -1.16044410406478),
    (0.4, 0.8, 3.45490811761268, -0.504177878131276),
    (0.4, 0.95, 3.78189640202513, -0.113066353724514),
    (0.4, 0.999, 3.94664440544861, -0.00216968823960868),
    (0.5, 0.3423, 3.91401914342982, -1.84637505835943),
    (0.5, 0.4137, 3.57776913574115, -1.39606944773731),
    (0.5, 0.4999, 3.40520695553603, -1.13327848025563),
    (0.5, 0.5001, 3.40496753486184, -1.13277113044752),
    (0.5, 0.8, 3.39395518363854, -0.407654079372042),
    (0.5, 0.999, 3.73350069922993, -0.0018348714406529),
    (0.566, 0.285, 4.12297268181408, -1.86588627943783),
    (0.566, 0.3775, 3.59560461539445, -1.29836761827306),
    (0.566, 0.5001, 3.35163546271226, -0.983092420038982),
    (0.566, 0.6, 3.29175294578786, -0.772829249392311),
    (0.566, 0.95, 3.52940825192708, -0.0856623547190566),
    (0.75, 0.1891, 4.62124912931994, -1.88782689151549),
    (0.75, 0.3075, 3.61591919517226, -1.12781794895546),
    (0.75, 0.4999, 3.20727915653469, -0.745199754213053),
    (0.75, 0.5001, 3.2071690523578, -0.744896784246644),
    (0.75, 0.8, 3.20396037329324, -0.286236068996117),
    (0.75, 0.999, 3.3746293936576, -0.0013533560096111),
    (1, 0.1243, 5.19744231331645, -1.89596713466529),
    (1, 0.2493, 3.63052618549983, -0.991914500927011),
    (1, 0.4999, 3.03840433132608, -0.578621640370214),
    (1, 0.5001, 3.03833859470779, -0.578389191825907),
    (1, 0.6, 3.01661969919912, -0.461253599385446),
    (1, 0.8, 3.03680400592249, -0.226103219759231),
    (1, 0.95, 3.107159603547, -0.055099469961726),
    (1, 0.999, 3.14084816826177, -0.00109057518676329),
    (2, 0.04465, 7.01933715143561, -1.90516520826935),
    (2, 0.1494, 3.70045142146255, -0.745751286553628),
    (2, 0.4999, 2.61064428918139, -0.330705861682836),
    (2, 0.6, 2.6041814978477, -0.264306684573433),
    (2, 0.95, 2.63148321697527, -0.0325377092187654),
    (5, 0.01138, 10.722711493953, -1.90519583964055),
    (5, 0.07543, 3.89424724949453, -0.52078956215389),
    (5, 0.5001, 2.09461285812553, -0.163810888361849),
    (5, 0.8, 2.09455675495237, -0.0654251105033156),
    (5, 0.999, 2.10086509421071, -0.000326091669332324),
    (10, 0.004028, 14.9657101788334, -1.90749281021706),
    (10, 0.04488, 4.11112496622233, -0.399206052097633),
    (10, 0.4999, 1.76477435383513, -0.0971324772353042),
    (10, 0.6, 1.76438790400964, -0.0776862020399),
    (10, 0.95, 1.76603204717647, -0.00969782421575255),
    (30, 0.0007758, 25.6296443578033, -1.90713272331035),
    (30, 0.0197, 4.5581692332995, -0.263061853138656),
    (30, 0.5001, 1.34208751302776, -0.0425348192830725),
    (30, 0.8, 1.3420852058048, -0.0170153768154534),
    (30, 0.999, 1.34235978410829, -8.50585888623918e-05),
    (100, 0.0001275, 46.5495509509991, -1.90694518252875),
    (100, 0.007984, 5.18275775337753, -0.167111734451886),
    (100, 0.4999, 0.993425521080629, -0.0172440394917024),
    (100, 0.6, 0.993418626611444, -0.0137924498551422),
    (100, 0.95, 0.993447882642516, -0.00172398362969808),
    (100, 0.999, 0.993458591126847, -3.447931433105e-05),
)

#: Folded states under law (8), in the same columns.
_FOLDED = (
    (0.05, 0.96, 2.79478137365207, -2.69510719774506),
    (0.3, 0.7, 3.15979217366397, -2.51038863710587),
    (0.4, 0.6, 3.40043194330681, -2.66097003393261),
    (0.5, 0.4, 4.05431124987021, -2.59674396280653),
    (0.566, 0.4, 4.22196922573404, -2.84689905161723),
    (1.0, 0.2, 5.38741822455853, -2.99928315102274),
    (1.0, 0.5, 4.4453617483096, -3.51214705081138),
    (2.0, 0.06, 7.56386969184992, -2.82551417347205),
    (5.0, 0.02, 11.1753763874408, -3.06566147936098),
)

#: Least pressures under law (8): ratio, p/T0, sbar/eta, tip angle.
_LEAST = (
    (0.4, 0.47317597362035, 3.59160122696539, -1.96375402844596),
    (0.5, 0.335565283690578, 4.02152972120112, -2.04257752483885),
    (0.566, 0.279374290504878, 4.25157272457215, -2.06131337197057),
    (0.75, 0.185395443309261, 4.78712299077195, -2.07981276022218),
    (1, 0.121837041296169, 5.40088498197455, -2.08722894160867),
    (2, 0.0437790971349555, 7.31976294326778, -2.09294892024681),
    (5, 0.0111533895199242, 11.2125523667343, -2.09421310031305),
    (10, 0.0039494687899288, 15.6528047483354, -2.09435692354437),
    (30, 0.000760600501631068, 26.8251258797367, -2.09439188208945),
    (100, 0.000124996616833829, 48.7356370046992, -2.09439488793627),
)

#: Folds in length under law (8), the first and the second from T: ratio, sbar/eta, p/T0, tip angle.
_LENGTH_FOLDS = (
    (0.33, 3.31738273388235, 0.639035780325063, -1.37471874480148),
    (0.4, 3.34851967147535, 0.648649863657782, -0.981388757790218),
    (0.5, 3.32039774894759, 0.650624400077079, -0.755761229049049),
    (0.75, 3.16651815363782, 0.651380380760904, -0.51252497746717),
    (1.0, 3.0138274945064, 0.65146631973857, -0.400498343955152),
    (2.0, 2.60334361267614, 0.651463792425444, -0.230062842195453),
    (5.0, 2.0931478999006, 0.651438448562098, -0.114172932036134),
    (0.33, 3.32521951790243, 0.601739219073301, -1.797051555995),
    (0.4, 3.60563887135454, 0.478572952469057, -2.1063590143428),
    (0.5, 4.10159212643589, 0.356468082528186, -2.37554260397625),
    (0.75, 4.95621303165795, 0.206785969173475, -2.52516003672038),
    (1.0, 5.61803222502465, 0.137450559575172, -2.55166852692515),
    (2.0, 7.66225378724786, 0.0500585624329445, -2.5779541198309),
    (5.0, 11.7777574931402, 0.0128306074281, -2.58806044162),
)

#: Linear law in the paper's groups: beta0, lambda, alpha1, tip angle.
_GROUPS = (
    (0.0, 1.0, -2.70523376555346, -0.094240181958501),
    (0.0, 1.0, 2.70523376555346, 0.094240181958501),
    (2.0, 0.5, -2.72828947662213, -0.0955236475126794),
    (4.0, -0.2, -2.09952054324776, -0.0740101641478175),
    (4.0, 1.0, -4.43540698907106, -0.154691040674967),
    (4.0, 3.0, -6.32123696729977, -0.216509133405673),
    (4.0, 3.0, 3.53969373703076, 0.120940726522022),
    (10.0, 1.0, -7.8835417895684, -0.276060078256707),
)

#: Folds in lambda at fixed beta0, linear law: beta0, lambda, alpha1, tip angle.
_LAM_FOLDS = (
    (2.0, -0.0671070649821767, -0.697144260992205, -0.0245327714482716),
    (4.0, -0.269001088273625, -1.39428202537255, -0.04917268497199),
    (10.0, -1.70720906773967, -3.48559531846322, -0.124875950437419),
)

#: Linear law, Fig 10: beta0, beta1, alpha, alpha1, tip angle; the lengths printed for (b) are not its groups.
_FIG_10 = (
    ("Fig 10a", 53.16, 113.1, 14.864604605976, -38.295395394024, -1.37801944248572, "lower"),
    (
        "Fig 10b, printed groups",
        1001.6,
        5670.6,
        298.432164675117,
        -703.167835324883,
        -2.97581431714708,
        "folded",
    ),
    (
        "Fig 10b, printed lengths",
        1002.12164002882482,
        5676.0169691232638,
        298.233910677637,
        -703.887729351188,
        -2.97424859961996,
        "folded",
    ),
)

#: tau = exp(-u): ratio, p/T0, sbar/eta, tip angle, y(0)/y0.
_EXPONENTIAL = (
    (0.5, 0.6, 3.3730230286623, -1.39865449855015, 1.12626122263502),
    (1.0, 0.8, 3.16523553976239, -0.250091443420967, 0.464212754378817),
    (2.0, 0.3, 3.49608789320925, -0.793598050236472, 3.19705914634596),
)


def tip_height(pressure_ratio: float) -> float:
    """y(0)/y0 under law (8)."""
    return 2.0 * (1.0 - pressure_ratio) if pressure_ratio >= 0.5 else 0.5 / pressure_ratio


def _rod(
    state: str, ratio: float, pressure_ratio: float, length_ratio: float, tip_angle: float, *tags: str
) -> Reference:
    beyond = pressure_ratio < 0.5 or (state == "folded" and pressure_ratio == 0.5)  # somewhere y > y0
    found = {"two-phase" if beyond else "one-phase", state, *tags}
    if pressure_ratio > 0.99:
        found.add("near-T")
    if abs(pressure_ratio - 0.5) < 1e-3:
        found.add("kink-at-tip")
    if ratio >= 10.0 and pressure_ratio < 0.5:
        found.add("boundary-layer")
    if any(r == ratio and pressure_ratio < 1.05 * P for r, P, *_ in _LEAST) and state == "unfolded":
        found.add("near-P_min")
    return Reference(
        f"r={ratio:g}, P={pressure_ratio:g}, {state}",
        {"ratio": ratio, "pressure_ratio": pressure_ratio, "law": "cohesive", "state": state},
        {"length_ratio": length_ratio, "tip_angle": tip_angle, "tip_height": tip_height(pressure_ratio)},
        1e-13 * max(1.0, length_ratio),
        frozenset(found),
    )


def _references() -> tuple[Reference, ...]:
    every = [_rod("unfolded", *row) for row in _UNFOLDED]
    every += [_rod("folded", *row) for row in _FOLDED]
    for ratio, P, sigma, angle in _LEAST:
        every.append(
            Reference(
                f"r={ratio:g}, least pressure",
                {"ratio": ratio, "kind": "LP-pressure", "law": "cohesive"},
                {"pressure_ratio": P, "length_ratio": sigma, "tip_angle": angle, "tip_height": tip_height(P)},
                1e-13 * max(1.0, sigma),
                frozenset({"fold", "LP-pressure", "two-phase" if P < 0.5 else "one-phase"}),
            )
        )
    seen: set[float] = set()
    for ratio, sigma, P, angle in _LENGTH_FOLDS:
        which = "second" if ratio in seen else "first"
        seen.add(ratio)
        every.append(
            Reference(
                f"r={ratio:g}, {which} fold in length",
                {"ratio": ratio, "kind": "LP-length", "law": "cohesive"},
                {"length_ratio": sigma, "pressure_ratio": P, "tip_angle": angle, "tip_height": tip_height(P)},
                1e-12 * max(1.0, sigma),
                frozenset({"fold", "LP-length", which, "two-phase" if P < 0.5 else "one-phase"}),
            )
        )
    for beta0, lam, alpha1, angle in _GROUPS:
        tags = {"groups", "one-phase", "spurious" if alpha1 > 0 else "lower"}
        every.append(
            Reference(
                f"beta0={beta0:g}, lambda={lam:g}, {'upper' if alpha1 > 0 else 'lower'}",
                {"beta0": beta0, "lam": lam, "law": "linear"},
                {"alpha1": alpha1, "tip_angle": angle},
                1e-13,
                frozenset(tags | ({"beta0=0"} if beta0 == 0.0 else set())),
            )
        )
    for beta0, lam, alpha1, angle in _LAM_FOLDS:
        every.append(
            Reference(
                f"beta0={beta0:g}, fold in lambda",
                {"beta0": beta0, "kind": "LP-lambda", "law": "linear"},
                {"lam": lam, "alpha1": alpha1, "tip_angle": angle},
                1e-13,
                frozenset({"fold", "LP-lambda", "groups"}),
            )
        )
    for ratio, P, sigma, angle, height in _EXPONENTIAL:
        every.append(
            Reference(
                f"r={ratio:g}, P={P:g}, exponential",
                {"ratio": ratio, "pressure_ratio": P, "law": "exponential", "state": "unfolded"},
                {"length_ratio": sigma, "tip_angle": angle, "tip_height": height},
                1e-12,
                frozenset({"one-phase", "unfolded", "curved-law"}),
                _ONE,
            )
        )
    return (
        *every,
        Reference(
            "r=1, sigma=3.1456, law (8)",
            {"ratio": 1.0, "length_ratio": 3.1456, "law": "cohesive", "state": "lower"},
            {
                "pressure_ratio": 0.396175185510736,
                "tip_angle": -0.708626098630455,
                "tip_height": 1.26206793935218,
            },
            1e-13,
            frozenset({"length-given", "two-phase", "lower"}),
        ),
        Reference(
            "r=1, sigma=3.1456, linear law",
            {"ratio": 1.0, "length_ratio": 3.1456, "law": "linear", "state": "lower"},
            {
                "pressure_ratio": 0.307937880709214,
                "tip_angle": -0.793424024075131,
                "tip_height": 1.38412423858157,
            },
            1e-13,
            frozenset({"length-given", "one-phase", "lower", "beyond-y0"}),
        ),
        *(
            Reference(
                name,
                {"beta0": beta0, "beta1": beta1, "law": "linear"},
                {"alpha": alpha, "alpha1": alpha1, "tip_angle": angle},
                1e-11 if state == "lower" else 1e-10,
                frozenset({"groups", "one-phase", state, "beyond-y0", "several-solutions"})
                | ({"disconnected"} if state == "folded" else set()),
            )
            for name, beta0, beta1, alpha, alpha1, angle, state in _FIG_10
        ),
    )


_EVERY = _references()

#: Questions whose default answer is the one expected, and folds.
REFERENCES: tuple[Reference, ...] = tuple(ref for ref in _EVERY if "disconnected" not in ref.tags)

#: Answers on branches that do not come from T: one of several at their groups, not the default.
DISCONNECTED: tuple[Reference, ...] = tuple(ref for ref in _EVERY if "disconnected" in ref.tags)


def tagged(*tags: str) -> tuple[Reference, ...]:
    """References that carry all the given tags."""
    return tuple(ref for ref in REFERENCES if ref.tags.issuperset(tags))
