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

// caption: HTML; svg: a plot.
[[nodiscard]] std::string html_figure(const std::string& caption, const std::string& svg);

}  // namespace alidade
