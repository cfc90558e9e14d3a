#pragma once

namespace sovo::app {

/// The style of a report: light, dark where the desktop is, and light on paper.
inline constexpr char kReportStyle[] = R"css(
:root{color-scheme:light dark;--back:#fff;--card:#f6f7f8;--text:#1c2024;--dim:#5d6670;
--edge:#d5d9dd;--main:#0b62b0;--second:#b3261e;--truth:#6b7178;--band:#0b62b033;--warn:#b35c00;
--good:#1a8a6b;--poor:#d9660a;--bad:#c62828;--init:#7657c9;--off:#9aa3ab;
--h0:#173f6e;--h1:#1d6394;--h2:#1f86a4;--h3:#27a59b;--h4:#5fbb75;--h5:#a8c34a}
@media (prefers-color-scheme:dark){:root{--back:#121518;--card:#1b1f24;--text:#e6e9ec;--dim:#9aa4ae;
--edge:#363d45;--main:#5db2ff;--second:#ff8a80;--truth:#a5adb5;--band:#5db2ff40;--warn:#ffb04d;
--good:#2fbf95;--poor:#ff8f3d;--bad:#ff5c5c;--init:#a58bf0;--off:#6b747d;
--h0:#2c5f9c;--h1:#2f80b8;--h2:#35a0bd;--h3:#45bfae;--h4:#86d68f;--h5:#d3e66e}}
@media print{:root{color-scheme:light;--back:#fff;--card:#fff;--text:#000;--dim:#444;--edge:#bbb;
--main:#0b62b0;--second:#b3261e;--truth:#6b7178;--band:#0b62b033;--warn:#b35c00;--good:#1a8a6b;
--poor:#d9660a;--bad:#c62828;--init:#7657c9;--off:#9aa3ab;
--h0:#173f6e;--h1:#1d6394;--h2:#1f86a4;--h3:#27a59b;--h4:#5fbb75;--h5:#a8c34a}
body{max-width:none;padding:0}*{-webkit-print-color-adjust:exact;print-color-adjust:exact}
figure,tr,.tiles div{break-inside:avoid}h2{break-after:avoid}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1240px;padding:1.2rem;background:var(--back);color:var(--text);
font:15px/1.45 system-ui,sans-serif}
h1{font-size:1.5rem;margin:0 0 .2rem;overflow-wrap:anywhere}
h2{font-size:1.1rem;margin:1.8rem 0 .6rem;border-bottom:1px solid var(--edge);padding-bottom:.2rem}
p{margin:.3rem 0;color:var(--dim);overflow-wrap:anywhere}
.tiles{display:grid;grid-template-columns:repeat(auto-fill,minmax(150px,1fr));gap:.6rem;margin:1rem 0}
.tiles div{background:var(--card);border:1px solid var(--edge);border-radius:6px;padding:.5rem .7rem}
.tiles dt{color:var(--dim);font-size:.8rem}
.tiles dd{margin:0;font-size:1.15rem;font-variant-numeric:tabular-nums}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,480px),1fr));gap:.8rem}
figure{margin:0;background:var(--card);border:1px solid var(--edge);border-radius:6px;padding:.3rem}
svg{display:block;width:100%;height:auto}
svg text{fill:var(--text);font-family:system-ui,sans-serif}
svg .title{font-size:14px;font-weight:600}svg .label{font-size:12px}
svg .tick{font-size:11px;fill:var(--dim)}
svg .area{fill:var(--back);stroke:var(--edge)}svg .grid{stroke:var(--edge);stroke-width:.6}
svg .line{fill:none;stroke-width:1.7;stroke-linejoin:round}svg .band{stroke:none}
svg .cloud{stroke-width:1.6;stroke-linecap:round;fill:none}
.wide{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid var(--edge);
vertical-align:top;overflow-wrap:anywhere}
th{color:var(--dim);font-weight:600}.num{text-align:right;white-space:nowrap}
ul{margin:.3rem 0;padding-left:1.2rem}li{overflow-wrap:anywhere}
)css";

}  // namespace sovo::app
