#include "edge_app/output/html_page.h"

#include <fmt/format.h>

#include "edge_app/output/svg_plot.h"

namespace alidade {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --paper: #ffffff; --ink: #1c2430; --soft: #5b6673; --rule: #dfe4ea;
  --panel: #f5f7f9; --a: #1f6fb2; --b: #c05a10; --bad: #c62828; --good: #2e7d32; }
@media (prefers-color-scheme: dark) { :root { --paper: #13171c; --ink: #e3e8ee; --soft: #98a4b1;
  --rule: #2c343d; --panel: #1b2128; --a: #5aa9e6; --b: #f0954a; --bad: #ff6b6b; --good: #66bb6a; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1088px; margin: 0 auto; padding: 28px 24px 48px; }
h1 { font-size: 25px; line-height: 1.25; margin: 0 0 16px; overflow-wrap: anywhere; }
h2 { font-size: 18px; margin: 36px 0 10px; }
p { margin: 6px 0; } .soft { color: var(--soft); }
.verdict { border-left: 5px solid var(--good); background: var(--panel); padding: 12px 16px;
  border-radius: 0 6px 6px 0; } .verdict.weak { border-color: var(--bad); }
.verdict strong { font-size: 17px; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(230px, 1fr)); gap: 10px;
  margin: 16px 0; padding: 0; list-style: none; }
.facts li { background: var(--panel); border-radius: 6px; padding: 8px 12px; color: var(--soft);
  font-size: 13px; } .facts b { display: block; color: var(--ink); font-size: 19px; font-weight: 600; }
.verdicts { margin: 0; padding: 0; list-style: none; }
.verdicts li { border-left: 4px solid var(--good); padding: 3px 12px; margin: 6px 0; }
.verdicts .grown { border-color: var(--b); } .verdicts .weak { border-color: var(--bad); }
td.words { white-space: normal; } a { color: var(--a); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
th { text-align: left; color: var(--soft); font-weight: 600; }
th, td { padding: 5px 18px 5px 0; border-bottom: 1px solid var(--rule); white-space: nowrap; }
.matrix { font-size: 12.5px; } .matrix th, .matrix td { border: 1px solid var(--paper); padding: 4px 7px; }
.matrix td { text-align: center; min-width: 62px; }
.matrix thead th { text-align: center; white-space: normal; vertical-align: bottom; }
figure { margin: 14px 0; } figcaption { color: var(--soft); font-size: 13.5px; margin: 0 0 4px; }
figcaption b { color: var(--ink); }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(420px, 100%), 1fr)); gap: 0 20px; }
svg { display: block; width: 100%; height: auto; font-size: 12px; font-variant-numeric: tabular-nums; }
svg text { fill: var(--soft); } svg .name { fill: var(--ink); font-size: 12.5px; }
svg .grid { stroke: var(--rule); } svg .frame { stroke: var(--soft); fill: none; }
svg .dots { fill: none; stroke-linecap: round; stroke-opacity: .75; }
svg .line { fill: none; stroke-width: 1.4; stroke-linejoin: round; }
svg .band { fill: var(--soft); fill-opacity: .14; } svg .gap { fill: var(--soft); fill-opacity: .22; }
svg .level { stroke: var(--soft); }
svg .a { stroke: var(--a); } svg .b { stroke: var(--b); } svg .bad { stroke: var(--bad); }
svg .ink { stroke: var(--ink); } svg .faint { stroke: var(--soft); stroke-opacity: .7; }
svg .area { stroke: none; } svg .area.a { fill: var(--a); } svg .area.b { fill: var(--b); }
.key { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin: 0 4px 0 8px; }
.key.a { background: var(--a); } .key.b { background: var(--b); } .key.bad { background: var(--bad); }
.key.ink { background: var(--ink); }
.plot { overflow-x: auto; }
/* A wide plot is moved sideways in its frame rather than squeezed until nobody can read it. */
@media (max-width: 700px) { main { padding: 18px 12px 36px; } svg.wide { width: 820px; font-size: 14px; }
  svg.wide .name { font-size: 14.5px; } svg.half, svg.half .name { font-size: 16px; }
  th, td { padding-right: 10px; } .facts { grid-template-columns: 1fr 1fr; } }
)";

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<main>\n<h1>{0}</h1>\n{2}"
      "</main>\n</body>\n</html>\n",
      title, kStyle, body);
}

std::string html_list(const std::string& title, const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string list = fmt::format("<h2>{}</h2>\n<ul>\n", title);
  for (const std::string& line : lines) list += fmt::format("<li>{}</li>\n", escape_html(line));
  return list + "</ul>\n";
}

std::string html_verdict(const char* kind, const std::string& number, const std::string& limit,
                         const std::string& words) {
  return fmt::format("<li class=\"{}\"><b>{}</b> <span class=\"soft\">({})</span>: {}</li>\n", kind,
                     number, limit, escape_html(words));
}

std::string html_figure(const std::string& caption, const std::string& svg) {
  return fmt::format("<figure><figcaption>{}</figcaption>\n<div class=\"plot\">{}</div></figure>\n",
                     caption, svg);
}

}  // namespace alidade
