#pragma once
// The page around a report: one self-contained static file with inline style and without script. It
// is light or dark as the reader's system, and also fits narrow screens. Pure; allocates.

#include <string>
#include <vector>

namespace alidade {

// title and body are HTML. Classes for the body: verdict (weak), verdicts (with items good, grown,
// weak), facts, words, scroll, pair, plot, key, soft, and the classes of SvgPlot.
[[nodiscard]] std::string html_page(const std::string& title, const std::string& body);

// A heading and its lines; empty if there are no lines. title: HTML; lines: plain text.
[[nodiscard]] std::string html_list(const std::string& title,
                                    const std::vector<std::string>& lines);

// The beginning of a list of verdicts, before items of html_verdict() and "</ul>".
inline constexpr const char* kHtmlVerdicts =
    "<h2>What the numbers say</h2>\n<ul class=\"verdicts\">\n";
// A number, what it is held against, and what that means. kind: good: as it should be; grown:
// allowed for, at a price; weak: beyond the limit. number, limit: HTML; words: plain text.
[[nodiscard]] std::string html_verdict(const char* kind, const std::string& number,
                                       const std::string& limit, const std::string& words);

// caption: HTML; svg: a plot.
[[nodiscard]] std::string html_figure(const std::string& caption, const std::string& svg);

}  // namespace alidade
