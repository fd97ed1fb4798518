"""Writers of made-up files in the formats of networks and agencies, as their own files look."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from tests.motions.written import peak

Channels = Sequence[tuple[str, Sequence[str]]]


def rows(tokens: Sequence[str], per_line: int, width: int) -> list[str]:
    """Right-justified fields, which touch where they are full."""
    return [
        "".join(f"{token:>{width}}" for token in tokens[i : i + per_line])
        for i in range(0, len(tokens), per_line)
    ]


def _file(lines: Sequence[str]) -> str:
    return "\n".join(lines) + "\n"


def _numeric_header(per_line: int, width: int, value: str, count: int = 100) -> list[str]:
    return rows([value] * count, per_line, width)


def csmip_v2(channels: Channels, dt_s: float, *, old: bool = False) -> str:
    lines: list[str] = []
    for number, (name, tokens) in enumerate(channels, 1):
        npts = len(tokens)
        text = [
            f"Corrected accelerogram   58667-L2866-14236.52       Chan  {number}: {name}   from   ",
            "Uncorrected Accelerogram Data             Processed: 08/24/14, CGS  667bv052    ",
            "SOMEWHERE EARTHQUAKE",
            "CSMIP Preliminary Processing            (Origin:  To be determined)             ",
            "58667-L2866-14236.52                 Start time:  8/24/14, 10:20:33.0 UTC (GPS) ",
            "Station No. 58667   37.973N, 122.038W    Etna    s/n 2866  (3 Chns of  3 at Sta)",
            "Somewhere - Clayton & Ellis               CGS   Data: Acceleration              ",
            f"Chan  {number}: {name}            ",
            "SOMEWHERE EARTHQUAKE     MAY 2, 1983 16:42 PDT",
            "Hypocenter:  To be determined.               ML:  To be determined.             ",
            "Instr Period =  .0102 sec,  Damping =  .640,  Sensitivity =  .62 v/g            ",
            f"                        Record length ={npts * dt_s:7.3f} sec.                 ",
            "                                     Uncor Max  =   .028 g , at  32.570 sec.    ",
            f"  {npts} points of instrument- and baseline-corrected accel, veloc and displ data ",
            f"Peak acceleration = {peak(tokens)} cm/sec/sec  at   32.570   sec.           ",
            "",
            *_numeric_header(16, 5, "1"),
            *_numeric_header(8, 10, ".000"),
        ]
        series = []
        for quantity, unit, samples in (
            ("accel", "cm/sec2.", tokens),
            ("veloc", "cm/sec.", ["1.0"] * npts),
            ("displ", "cm.", ["2.0"] * npts),
        ):
            layout = f"in {unit} (8f10.6)    "
            if old:
                layout = f"(UNITS: {unit.replace('sec2', 'sec/sec').removesuffix('.')})"
            series.append(
                f"{npts:7d} points of {quantity} data equally spaced at {dt_s:6.3f} sec, {layout}"
            )
            series += rows(samples, 8, 10)
        if old:
            text, series = [t.upper() for t in text], [t.upper() for t in series]
        lines += [*text, *series, f"/&  ----------  End of data for channel  {number}  ----------"]
    return _file(lines)


def cosmos(
    tokens: Sequence[str],
    dt_s: float,
    *,
    channel: str = "HNE",
    direction: str = " 90 Deg",
    quantity: str = "acceleration",
    layout: tuple[int, int] = (1, 15),
    unit: str = "cm/sec2(04)",
) -> str:
    reals = ["-999.000000"] * 100
    reals[33], reals[61] = "0.020000", f"{dt_s * 1000:.6f}"
    npts = len(tokens)
    return _file(
        [
            f"Corrected {quantity}  (Format v01.20 with 13 text lines)",
            "Record of     Somewhere, NV Earthquake of Fri May 15, 2020 11:03 UTC",
            "Hypocenter: 38.15880 -117.87650 H=  4km Ml=6.4",
            "Origin: 2020/05/15 11:03:27    UTC",
            "Statn No: 06-       Code:CI-ABCD    CIT  Somewhere",
            "Coords: 37.6302 -118.8361  Site geology:",
            "Recorder:                 ( ? Chns of   6 at Sta) Sensor: Unknown          ",
            "Rcrd start time: 2020/05/15 11:03:14.418 UTC (Q=5) RcrdId: (see comment)",
            f"Sta Chan   ?:{direction} (Rcrdr Chan  ?) Location:",
            "Raw record length = 192.000 sec, Uncor max =     48576, at  54.570 sec.",
            f"Processed:2020-05-18 21:06:00 GMT, USGS, Max = {peak(tokens)} cm/sec2 at 54.570 sec",
            "Record filtered below       Hz (periods over       secs), and above      Hz",
            "Values used when parameter or data value is unknown/unspecified:   -999, -999.00",
            " 100 Integer-header values follow on  10 lines, Format= (10I8)",
            *_numeric_header(10, 8, "-999"),
            " 100 Real-header values follow on  20 lines, Format= (5F15.6)",
            *rows(reals, 5, 15),
            '   2 Comment line(s) follow, each starting with a "|":',
            f"| RcrdId: NN.00725272.CI.ABCD.{channel}.--",
            f"|<SCNL>ABCD.{channel}.CI.--    <AUTH> 2020/04/18 18:33:03.000",
            f"{npts:8d} {quantity} pts, approx {npts * dt_s:4.0f} secs, units={unit},"
            f"Format=({layout[0]}E{layout[1]}.6)",
            *rows(tokens, *layout),
            f"End-of-data for Chan{channel} {quantity}",
        ]
    )


def cdmg_v1(channels: Channels, dt_s: float) -> str:
    lines: list[str] = []
    for number, (name, tokens) in enumerate(channels, 1):
        npts = len(tokens)
        pairs = [cell for i, token in enumerate(tokens) for cell in (f"{i * dt_s:.3f}", token)]
        lines += [
            "UNCORRECTED ACCELEROGRAM DATA              PROCESSED: 05/24/2011",
            "SOMEWHERE 2010",
            "02/27/2010 3:53:52 (GMT)                (ORIGIN: 02/27/2010 3:53:52 GMT)",
            "                                   TRIGGER TIME: 2/27/2010 3:54:12.000 GMT",
            "STATION NO.          0.000N    0.000E  QDR       S/N  760 (3  CHNS OF 3  AT STA)",
            "ABCD S/N 760",
            f"CHAN  {number}: {name}       (STA CHN:  {number})               ",
            "SOME UNIVERSITY",
            "HYPOCENTER:   0.000N    0.000E  H=   0.0KM   ML= 0.00",
            "INSTR PERIOD = 0.0391 SEC,  DAMPING =0.7000,  SENSITIVITY =1.250 VDC/G",
            f"NO. OF POINTS ={npts:7d}  RECORD LENGTH ={npts * dt_s:7.3f} SEC",
            f"UNITS OF UNCOR ACCEL ARE SEC AND G/10.     MAX  = {peak(tokens, 0.1)} G, AT 3 SEC",
            "RMS ACCEL OF COMPLETE RECORD = 0.106 G",
            *_numeric_header(16, 5, "1"),
            *_numeric_header(8, 10, "0.000", 50),
            *rows(pairs, 10, 7),
            f"/&  ----------  END OF DATA FOR CHANNEL {number}  ----------",
        ]
    return _file(lines)


SERIES_LINES = {
    "new": "{npts:6d} Accelerogram points at {rate:3d} pts/sec in units of g.     Format: (8f9.6)",
    "old": "{npts:6d} POINTS OF ACCEL DATA EQUALLY SPACED AT {dt:.3f} SEC.  (UNITS: G)",
}

UNIT_LINES = {
    "new": "Units of uncor data are sec and g.         Max  = {peak} g, at   31.575 sec.",
    "old": "UNITS OF UNCOR ACCEL IS G.                 MAX  = {peak} G, AT   9.425 SEC.",
    "": "",
}


def csmip_v1(
    channels: Channels, dt_s: float, *, unit: str = "new", series: str = "new", last: int = 1
) -> str:
    """V1 with accelerations alone; `last` is 0 where the record length is that of the intervals."""
    lines: list[str] = []
    for number, (name, tokens) in enumerate(channels, 1):
        npts = len(tokens)
        about = SERIES_LINES[series].format(npts=npts, rate=round(1.0 / dt_s), dt=dt_s)
        lines += [
            "Uncorrected Accelerogram Data             Processed: 08/29/18, CGS  ce23837j    ",
            "Rcrd of Tue Aug 28, 2018 19:33:00.0 PDT               (Avol1 v2.0, 4/18 CSMIP)  ",
            "CSMIP Preliminary Processing            (Origin:  To be determined)             ",
            "23837-L1193-18241.36                 Start time:  8/29/18, 02:33:  .0 UTC (GPS) ",
            "Station No. 23837   34.063N, 117.785W    Etna    s/n 1193  (3 Chns of  3 at Sta)",
            "Somewhere - Grove                         CGS   Data: Acceleration              ",
            f"Chan  {number}: {name}                ",
            "Rcrd of Tue Aug 28, 2018 19:33:00.0 PDT    Tue Aug 28, 2018 19:33:00.0 PDT      ",
            "Hypocenter:  To be determined.               ML:  To be determined.             ",
            "Instr Period =  .0111 sec,  Damping =  .670,  Sensitivity =  .63 v/g            ",
            f"No. of Points = {npts:6d}  Record Length ={(npts - 1 + last) * dt_s:7.3f} sec",
            UNIT_LINES[unit].format(peak=peak(tokens)),
            "RMS calc for complete record =        .   Chn. metadata effective date: 11/05/02",
            *_numeric_header(16, 5, "1"),
            *_numeric_header(8, 10, "0.000", 50),
            about,
            *rows(tokens, 8, 9),
            f"/&  ----------  End of data for channel {number}  ----------",
        ]
    return _file(lines)


def bhrc_v1(channels: Channels, dt_s: float) -> str:
    lines: list[str] = []
    for name, tokens in channels:
        npts = len(tokens)
        reals = [".000000E+00"] * 50
        reals[2] = f"{npts * dt_s:.5E}"
        lines += [
            "* VOL1DS FILE:  1234/01",
            "Inst Type = SSA-2",
            "Origin Time : 2012/08/11   12:23:16",
            "",
            name[0],
            "                                                                      ",
            f"COMP {name}                                                               ",
            "Abcd                      Station   38.474 N 47.059 E   Altitude 1360m   "
            "Azimuth L 352   T 82 ",
            "Epicenter 38.520 N 46.860 E   FD 12 Km mb      Ms      Mw6.1   M        ML   (BHRC)",
            "INSTR PERIOD =  .019 SEC   DAMPING =  .640                            ",
            f"NO. OF POINTS ={npts:7d}      DURATION ={npts * dt_s:8.3f}                        ",
            "UNITS ARE SECONDS AND G/10",
            "                                                                      ",
            *_numeric_header(16, 5, "0"),
            *(row[:70] for row in rows(reals, 8, 13)),
            *rows(tokens, 10, 13),
            "/&",
        ]
    return _file(lines)


def knet(
    counts: Sequence[int],
    frequency_hz: int,
    *,
    direction: str = "E-W",
    scale: str = "7845(gal)/8223790",
    duration: str | None = None,
) -> str:
    fields = {
        "Origin Time": "2018/01/24 19:51:00",
        "Lat.": "41.0",
        "Long.": "142.5",
        "Depth. (km)": "30",
        "Mag.": "6.2",
        "Station Code": "ABC003",
        "Station Lat.": "41.4053",
        "Station Long.": "141.1691",
        "Station Height(m)": "4",
        "Record Time": "2018/01/24 19:51:38",
        "Sampling Freq(Hz)": f"{frequency_hz}Hz",
        "Duration Time(s)": duration or f"{len(counts) / frequency_hz:g}",
        "Dir.": direction,
        "Scale Factor": scale,
        "Max. Acc. (gal)": _largest_gal(counts, scale),
        "Last Correction": "2018/01/24 19:51:38",
        "Memo.": "",
    }
    header = [f"{name:<18}{value}" for name, value in fields.items()]
    return _file(header + [f"{row} " for row in rows([str(c) for c in counts], 8, 9)])


def knet_csv(table: Sequence[Sequence[str]], frequency_hz: int) -> str:
    """Text of rows of north-south, east-west and vertical acceleration [gal]."""
    rows_of_values = [
        f"2024/01/01 00:00:15.{at:02d},{at / frequency_hz:.2f},{','.join(row)}"
        for at, row in enumerate(table)
    ]
    return _file(
        [
            "#K-NET CSV",
            "#Event",
            "#OriginTime,Latitude,Longitude,Depth(km),Magnitude",
            "#2024/01/01 00:00:00,35.000,135.000,10,6.0",
            "#Station",
            "#Code,Latitude,Longitude,Height(m)",
            "#XXX001,35.0000,135.0000,10",
            "#Record",
            "#SamplingFrequency(Hz)",
            f"#{frequency_hz}",
            "#DurationTime(s)",
            f"#{len(table) / frequency_hz:g}",
            "#Time,RelativeTime(s),N-S(gal),E-W(gal),U-D(gal)",
            *rows_of_values,
        ]
    )


def _largest_gal(counts: Sequence[int], scale: str) -> str:
    """The largest acceleration after the mean was taken off."""
    numbers = [float(part) for part in re.findall(r"[\d.]+", scale)]
    offset = sum(counts) / len(counts)
    return peak([repr(count - offset) for count in counts], numbers[0] / numbers[-1])


def esm_asc(
    tokens: Sequence[str], dt_s: float, *, stream: str = "HNE", unit: str = "cm/s^2"
) -> str:
    return _file(
        [
            "EVENT_NAME: 202302060117",
            "EVENT_ID: 13194",
            "EVENT_TIME_HHMMSS: 01:17:32.00000",
            "MAGNITUDE_L: ",
            "NETWORK: TK",
            "STATION_CODE: 0131",
            "VS30_M/S: None",
            f"SAMPLING_INTERVAL_S: {dt_s:g}",
            f"NDATA: {len(tokens)}",
            f"DURATION_S: {(len(tokens) - 1) * dt_s:g}",
            f"STREAM: {stream}",
            f"UNITS: {unit}",
            f"PGA_CM/S^2: {peak(tokens, 100.0 if unit.startswith('m') else 1.0)}",
            "HEADER_FORMAT: DYNA 1.2",
            "DATA_TYPE: Acceleration",
            "USER5: ",
            *tokens,
        ]
    )


AFAD_PREAMBLE = (
    "AAD_Filtered_FILE\nAAD_BASELINE_CORRECTION: BASELINE NOT REMOVED\n"
    "AAD_FILTER_ORDER: 1\nAAD_LOW_CUT_FREQUENCY_HZ: 0.025\nAAD_HIGH_CUT_FREQUENCY_HZ: 40.0\n"
)
"""What AFAD writes above an ESM header."""


def csmnc(tokens: Sequence[str], dt_s: float, *, quantity: str = "UNCORRECTED ACCELERATION") -> str:
    return _file(
        [
            "012ABC120103153901",
            "0120103153957 2012-01-03 15:39:57 BTM",
            "SOMEWHERE EARTHQUAKE, SOMEWHERE,CHN",
            "EPICENTER  39.939N 77.339E DEPTH 9 KM",
            "MAGNITUDE  4.0(Ms)",
            "STATION: 12ABC 39.700N 77.599E",
            "SITE CONDITION: SOIL",
            "INSTRUMENT TYPE: ETNA/ES-T",
            "OBSERVING POINT: GROUND",
            "COMP. EW",
            f"{quantity}          UNIT: CM/SEC/SEC",
            f"NO. OF POINTS:  {len(tokens)}  EQUALLY SPACED INTERVALS OF:  {dt_s:g}  SEC",
            f"PEAK VALUE:    {peak(tokens)}   AT   27.06 SEC    "
            f"DURATION:  {len(tokens) * dt_s:g} SEC",
            "PRE-EVENT TIME:  20  SEC  RECORDER TIME:  2012-01-3 15:39:44.000 BTM",
            "CSMNC",
            "",
            *(f"{row} " for row in rows(tokens, 8, 14)),
        ]
    )


BBP_COLUMNS = {
    "names": "#    time(sec)      N-S({unit})      E-W({unit})      U-D({unit})\n",
    "lines": "# Station: abcd\n#    Vs30 (m/s): 450\n# Column 1: Time (s)\n"
    "# Column 2: North-south acceleration ({unit}) (+ is northward)\n"
    "# Column 3: East-west acceleration ({unit}) (+ is eastward)\n"
    "# Column 4: Up-down acceleration ({unit}) (+ is upward)\n#\n",
    "units": "# Station: abcd\n#   units= {unit}\n# Column 1: Time (s)\n"
    "# Column 2: H1 component ground acceleration (+ is 000)\n"
    "# Column 3: H2 component ground acceleration (+ is 090)\n"
    "# Column 4: V component ground acceleration (+ is upward)\n",
    "none": "# HF Sim NGAH, stat=abcd\n",
}


def scec_bbp(
    table: Sequence[Sequence[str]], dt_s: float, *, columns: str = "names", unit: str = "cm/s/s"
) -> str:
    """`table` has a row a sample: N-S, E-W, U-D."""
    return BBP_COLUMNS[columns].format(unit=unit) + _file(
        ["\t".join([f"{i * dt_s:.6e}", *row]) for i, row in enumerate(table)]
    )


def cwb(table: Sequence[Sequence[str]], frequency_hz: int, *, names: str = "UNE") -> str:
    """`table` has a row a sample, a column a component."""
    return _file(
        [
            "#Earthquake Information",
            "#Origin Time(GMT+08): 2021/04/18-22:11:39",
            "#Magnitude(Ml): 5.8",
            "",
            "#Station Information",
            "#StationCode: ABCD",
            "#StationName: Somewhere",
            f"#RecordLength(sec): {len(table) / frequency_hz:g}",
            f"#SampleRate(Hz): {frequency_hz}",
            "#AmplitudeUnit:  gal. DCoffset(corr)",
            *(
                f"#AmplitudeMAX. {name}: {peak(column)}~ 0.000"
                for name, column in zip(names, zip(*table, strict=True), strict=True)
            ),
            f"#DataSequence: Time {'; '.join(f'{name}(+)' for name in names)}",
            f"#Data: {1 + len(names)}F10.3 ",
            *(
                f"{i / frequency_hz:10.3f}" + "".join(f"{token:>10}" for token in row)
                for i, row in enumerate(table)
            ),
        ]
    )


def unam(table: Sequence[Sequence[str]], dt_s: float, *, names: Sequence[str]) -> str:
    rule = "---------+" * 8
    npts, count = len(table), len(names)

    def cell(value: object) -> str:
        return "".join(f"/{value}" for _ in names)

    return _file(
        [
            "*" * 80,
            "                       INSTITUTO DE INGENIERIA, UNAM",
            "*" * 80,
            "ARCHIVO ESTANDAR DE ACELERACION:",
            "VERSION DEL FORMATO                    : 2.0",
            "",
            "=" * 80,
            "NOMBRE DE LA ESTACION                  : ALGUN LUGAR, PEÑA",
            "CLAVE DE LA ESTACION                   : ABCD",
            "                                       : ",
            f"NUMERO DE CANALES                      : {count}",
            f"ORIENTACION C1-C6 (rumbo;orientacion)  : {''.join(f'/{name}' for name in names)}",
            "ORIENTACION C7-C12 (rumbo;orientacion) : ",
            f"INTERVALO DE MUESTREO, C1-C6 (s)       : {cell(f'{dt_s:g}')}",
            "INTERVALO DE MUESTREO, C7-C12 (s)      : ",
            "FECHA DEL SISMO [GMT]                  : 2017/09/19",
            "HORA EPICENTRO (GMT)                   : 18:14:40",
            f"DURACION DEL REGISTRO (s), C1-C6       : {cell(f'{npts * dt_s:.3f}')}",
            f"NUM. TOTAL DE MUESTRAS, C1-C6          : {cell(npts)}",
            "ACEL. MAX.(Gal), C1-C6                 : "
            + "".join(f"/{peak(column, decimals=4)}" for column in zip(*table, strict=True)),
            "UNIDADES DE LOS DATOS                  : Gal (cm/s/s)",
            f"FORMATO DATOS (FORTRAN,10 campos/dato) : {count}F10.4",
            "",
            "=" * 80,
            "DATOS DE ACELERACION:",
            rule,
            "".join(f"   CANAL-{i}" for i in range(1, count + 1)),
            "".join(f"{name:>10}" for name in names),
            rule,
            *("".join(f"{token:>10}" for token in row) for row in table),
        ]
    )


def nsmn(table: Sequence[Sequence[str]], dt_s: float) -> str:
    return _file(
        [
            "STRONG GROUND MOTION RECORDS OF TURKIYE",
            "PLACE                   : AYDıN SOMEWHERE",
            "EARTHQUAKE DATE         : 2017/07/20 22:31:09 (GMT)",
            "STATION ID              : 0921",
            f"NUMBER OF DATA          : {len(table)}",
            f"SAMPLING INTERVAL (sec) : {dt_s:g}",
            "RAW PGA VALUES (gal)    : "
            + " ".join(
                f"({name}) {peak(column, decimals=6)}"
                for name, column in zip(
                    ("N-S", "E-W", "U-D"), zip(*table, strict=True), strict=True
                )
            ),
            "Copyright EARTHQUAKE DEPARTMENT",
            "DISASTER AND EMERGENCY MANAGEMENT PRESIDENCY",
            "       N-S          E-W          U-D",
            *("".join(f" {token:>12}" for token in row) for row in table),
        ]
    )


def usgs_smc(
    tokens: Sequence[str],
    frequency_hz: float,
    *,
    component: str = "    360",
    kind: str = "2 CORRECTED ACCELEROGRAM",
) -> str:
    integers = ["-32768"] * 48
    integers[15], integers[16] = "3", str(len(tokens))
    reals = ["0.1700000E+39"] * 50
    reals[1] = f"{frequency_hz:.7E}"
    return _file(
        [
            f"{kind:<80}",
            "*",
            "ABC0A",
            "     1989  10  18    0004 Somewhere, CA",
            "Moment Mag=      7.1 Ms=      7.1 Ml=      7.0",
            f"station = San Somewhere, 1295 Street, F component={component}      ",
            f"epicentral dist =     89.0       pk     = {peak(tokens, decimals=1)}",
            "inst type=SMA-1      data source = USGS",
            "*",
            "*",
            "*",
            *rows(integers, 8, 10),
            *rows(reals, 5, 15),
            "|",
            "|ref - a report of 1989",
            "|",
            *rows(tokens, 8, 10),
        ]
    )


def simcenter_event(
    values: Sequence[float], dt_s: float, *, steps: int | None = None, dof: int = 1
) -> str:
    event = {
        "name": "Somewhere-Station",
        "type": "Seismic",
        "dT": dt_s,
        "numSteps": len(values) if steps is None else steps,
        "timeSeries": [{"name": "accel_X", "type": "Value", "dT": dt_s, "data": list(values)}],
        "pattern": [{"type": "UniformAcceleration", "timeSeries": "accel_X", "dof": dof}],
    }
    return json.dumps({"Events": [event]}, indent=1)


def ucgmsim_text(
    tokens: Sequence[str], dt_s: float, *, component: str = "000", npts: int | None = None
) -> str:
    count = len(tokens) if npts is None else npts
    return _file(
        [
            f"ABCD       {component} ",
            f"{count}  {dt_s:.5e} 0 0  0.00000e+00  0.00000e+00  0.00000e+00  0.00000e+00",
            *(
                "".join(f" {token:>13}" for token in tokens[i : i + 6])
                for i in range(0, len(tokens), 6)
            ),
        ]
    )
