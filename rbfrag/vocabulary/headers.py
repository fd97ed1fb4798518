"""Column headers in five languages, and the words of cells; each list can be extended.

A header is read as its words, in any order, without case, accents and units ("Höhe [cm]": hohe).
"""

from __future__ import annotations

TYPE_CHECKING = False  # that of `typing` would load it
if TYPE_CHECKING:
    from collections.abc import Mapping

# fmt: off
_WORDS = {
    "block": "block blocks bloc blocs blocco blocchi bloque bloques blocke bloecke",
    "dip":
        "dip inclination tilt beta β neigung einfallen fallwinkel neigungswinkel einfallwinkel "
        "pendage inclinaison plongement buzamiento inclinacion immersione inclinazione pendenza",
    "dip base": "basisneigung basiseinfallen sohlneigung basisneigungswinkel",
    "slope": "slope hang boschung versant talud ladera versante pendio",
    "base": "base basal basis sole sohle basisflache",
    "base joint": "basiskluft",
    "joint":
        "joint joints fracture fractures discontinuity kluft klufte trennflache diaclase "
        "diaclases discontinuite diaclasa diaclasas discontinuidad giunto giunti discontinuita "
        "frattura",
    "plane": "plane planes ebene flache plan plano piano",
    "face": "face surface wandflache paroi cara faccia parete",
    "back": "back rear rucken hinterer hintere arriere trasera trasero posterior posteriore retro",
    "back face": "ruckflache rueckflaeche ruckseite",
    "back joint": "ruckkluft",
    "behind": "behind dahinter hinten derriere detras dietro",
    "rock": "rock fels gestein roche rocher roca roccia",
    "present": "present exists vorhanden presente existe",
    "no": "without kein keine ohne sans sin senza",
    "friction": "friction phi φ reibung frottement friccion rozamiento attrito",
    "friction angle": "reibungswinkel reibwinkel",
    "basic": "basic haupt",
    "residual": "residual restreibung residuel residuelle residuo",
    "friction angle residual": "restreibungswinkel restscherwinkel",
    "angle": "angle winkel angulo angolo",
    "between": "between zwischen entre tra fra",
    "gamma": "gamma γ",
    "height": "height h ht hohe hoehe hauteur alto altura altezza",
    "block height": "blockhohe blockhoehe",
    "width":
        "width w b thickness breite dicke machtigkeit largeur epaisseur ancho anchura espesor "
        "grosor larghezza spessore",
    "block width": "blockbreite blockdicke",
    "spacing": "spacing abstand espacement espaciado espaciamiento spaziatura",
    "spacing joint": "kluftabstand",
    "s1": "s1",
    "s2": "s2",
    "water": "water groundwater wasser eau agua acqua hw",
    "water level": "wasserstand wasserspiegel wasserhohe wasserdruckhohe",
    "level": "level table column head niveau nivel livello battente",
    "drainage": "drainage drained drainiert entwasserung draine drenaje drenado drenaggio drenato",
    "crack": "crack riss spalt fissure grieta fessura",
    "above": "above over uber dessus sobre sopra",
    "cohesion": "cohesion kohasion kohaesion coesione",
    "c": "c",
    "bridge": "bridge bridges brucke brucken pont ponts puente puentes ponti",
    "density": "density dichte rohdichte densite densidad densita rho ρ",
    "density rock": "gesteinsdichte felsdichte",
    "mass": "mass masse massa masa",
    "volume": "volume volumique volumen volumetrico",
    "unit": "unit unitaire unitario especifico specifico",
    "heavy": "weight poids peso gewicht",
    "unit heavy": "wichte raumgewicht",
    "displacement": "displacement slip verschiebung deplacement desplazamiento spostamento",
    "limit": "limit limiting maximum allowable limite grenze zulassige",
    "displacement limit": "grenzverschiebung",
    "kind": "kind type typ art tipo genre",
    "failure": "failure versagen rupture rotura rottura",
    "free": "free frei libre libero",
    "standing": "standing stands stand stehend",
    "free standing": "freestanding freistehend isole isolee isolato isolata exento exenta",
    "id": "id name designation bezeichnung nom nombre nome label",
    "number": "no nr num number nummer numero",
    "count": "count anzahl cantidad quantita quantity",
    "site": "site standort sito sitio",
    "latitude": "latitude lat breitengrad latitud latitudine",
    "longitude": "longitude lon long langengrad longitud longitudine",
    "pgv": "pgv",
    "pga": "pga",
    "pgd": "pgd",
    "peak": "peak spitzen maximale maxima massima picco",
    "ground": "ground boden sol suelo terreno",
    "velocity": "velocity geschwindigkeit vitesse velocidad velocita",
    "acceleration": "acceleration beschleunigung aceleracion accelerazione",
    "peak ground velocity": "bodengeschwindigkeit spitzenbodengeschwindigkeit",
    "peak ground acceleration": "bodenbeschleunigung spitzenbodenbeschleunigung",
}
"""The words for a concept, or for several at once ("basisneigung" is "dip base")."""

_FILLERS = (
    "of the a an in on at to and with from for is der die das des dem den im am in an von vom "
    "und zur zum de du la le les l d en au et sur del el los las y al di della dello dei il lo "
    "e nel nella "
)

_FIELDS = {
    "block_id": ("block ~number", "id", "number id"),
    "site_id": ("site", "site id", "site number"),
    "count": ("count",),
    "lat": ("latitude",),
    "lon": ("longitude",),
    "kind": ("kind ~failure",),
    "free_standing": ("free ~standing",),
    "no_back": ("no back ~face ~plane ~joint", "no rock ~behind", "no behind"),
    "back_fracture": (
        "back face ~present ~rock", "back plane present", "back present", "back joint present",
        "rock behind ~present", "behind",
    ),
    "height_m": ("height",),
    "width_m": ("width",),
    "beta_deg": ("dip ~angle ~base ~plane", "dip base joint ~angle ~plane", "slope base"),
    "phi_deg": ("friction ~angle ~basic ~peak ~base ~joint ~plane",),
    "phi_back_deg": ("friction back ~angle ~face ~plane ~joint",),
    "phi_residual_deg": ("friction residual ~angle",),
    "gamma_deg": ("gamma ~angle", "angle between joint ~plane", "angle between plane"),
    "s1_m": ("s1 ~spacing ~base ~joint", "spacing base ~joint"),
    "s2_m": ("s2 ~spacing ~back ~joint", "spacing back ~joint"),
    "base": ("base ~joint ~plane",),
    "back": ("back ~joint ~plane",),
    "face": ("face ~slope",),
    "drainage": ("drainage ~water ~joint ~back ~behind",),
    "water_m": ("water ~height ~level ~joint ~back ~crack ~base ~above",),
    "cohesion_pa": ("cohesion ~joint ~base ~rock ~bridge", "c"),
    "density_kg_m3": (
        "density ~rock", "mass volume ~rock", "unit heavy ~rock ~volume = kN/m3",
        "heavy volume ~rock = kN/m3",
    ),
    "displacement_m": ("displacement ~limit",),
    "pgv_m_s": ("pgv", "peak ground velocity"),
    "pga_g": ("pga", "peak ground acceleration"),
}
"""Which concepts name a field: those with a tilde may be missing, and "block" may always be there;
``= kN/m3`` is the unit of a header that names none."""

_PHRASES = {
    "count": (
        "number of blocks", "no of blocks", "number of identical blocks", "nombre de blocs",
        "numero di blocchi", "numero de bloques",
    ),
    "no_back": ("no back", "no back face", "no back plane", "no rock behind"),
}
"""Complete headers of a field."""

_INPUTS = {
    "beta_deg": "dip beta β incl slope tilt neig einfall fallw pend plong buzam immers gefalle",
    "phi_deg": "frict phi φ reib frott friccion rozam attrit",
    "water_m": "water groundwater wasser grundwasser eau= agua acqua seep nappe falda hw=",
    "drainage": "drain undrain entwass dren",
    "cohesion_pa": "cohes kohas kohaes coes",
    "kind": "kind type typ= tipo free frei isol exent standing sliding toppl rocking failure",
    "back_fracture":
        "back rear= ruck behind dahinter hinten arriere derriere detras dietro posterior trasera",
    "height_m": "height hight hohe hoehe hauteur altezza altura alto= blockhohe",
    "width_m":
        "width thick breite dicke machtig largeur epaiss ancho anchura espesor grosor larghez "
        "spess",
    "s1_m": "spacing kluftabst espac spaziat",
    "density_kg_m3": "densit density dichte densidad wichte raumgew",
    "displacement_m": "displac verschieb grenzverschieb deplac desplaz spostam",
    "pgv_m_s": "pgv= pga= pgd= sa= psa= shak accel beschleun bodenb bodeng aceler",
}
"""Beginnings of words ("=": complete words) of columns that would change the answer: such a column
is used, or the table is rejected."""

_KINDS = {
    "toppling": ("toppling", "topple", "backed", "kippen", "basculement", "vuelco", "ribaltamento"),
    "rocking": (
        "rocking", "rock", "overturning", "free", "free standing", "freestanding", "freistehend",
        "isole", "isolato", "exento",
    ),
    "sliding": ("sliding", "slide", "gleiten", "glissement", "deslizamiento", "scivolamento"),
    "slumping": ("slumping", "slump"),
    "confined_toppling": ("confined toppling", "confined topple"),
}

_DRAINAGES = {
    "undrained": ("undrained", "undrainiert", "non draine", "no drenado", "non drenato"),
    "drained": ("drained", "drainiert", "draine", "drenado", "drenato"),
}

_ANSWERS = {
    "yes": (
        "yes", "y", "true", "1", "x", "ja", "j", "oui", "o", "si", "s", "vrai", "wahr", "verdadero",
        "vero",
    ),
    "no": ("no", "n", "false", "0", "nein", "non", "faux", "falsch", "falso"),
}
# fmt: on

REMARKS = (
    "remark", "comment", "note", "photo", "foto", "picture", "date", "datum", "bemerk", "observ",
    "sketch", "author", "inspector", "surveyor",
)  # fmt: skip
"""Beginnings of words of columns that never change an answer."""


def _by_word(words_by_meaning: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    return {word: meaning for meaning, words in words_by_meaning.items() for word in words}


def _pattern(field: str, text: str) -> tuple[str, frozenset[str], frozenset[str], str | None]:
    concepts, _, unit = text.partition(" = ")
    optional = {concept[1:] for concept in concepts.split() if concept[0] == "~"}
    required = frozenset(concept for concept in concepts.split() if concept[0] != "~")
    return field, required, required | optional | {"block"}, unit or None


CONCEPTS = {
    **{word: tuple(key.split()) for key, words in _WORDS.items() for word in words.split()},
    **dict.fromkeys(_FILLERS.split(), ()),
}
"""The concepts that a word means, by word."""

PATTERNS = tuple(_pattern(field, text) for field, texts in _FIELDS.items() for text in texts)
"""Field, required concepts, permitted concepts, and the unit of a header without one."""

PHRASES = _by_word(_PHRASES)
"""The field of a complete header."""

STEMS = tuple((stem, field) for field, stems in _INPUTS.items() for stem in stems.split())
"""Beginnings of words, and the field that they may mean."""

KINDS = _by_word(_KINDS)
DRAINAGES = _by_word(_DRAINAGES)
ANSWERS = {word: answer == "yes" for word, answer in _by_word(_ANSWERS).items()}
"""The kind of failure, the drainage, and the answer that a cell names, by its words."""
