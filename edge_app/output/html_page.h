#pragma once
// The page around a report: one self-contained static file with inline style and no script, light and dark as the reader's system
// is, for narrow screens too. Pure; allocates.

#include <string>
#include <vector>

namespace alidade {

// title and body are HTML. The body's classes: verdict (weak), facts, scroll, pair, plot, key, soft, and those of SvgPlot.
[[nodiscard]] std::string html_page(const std::string& title, const std::string& body);

// A heading and its lines, which are plain text; empty without lines.
[[nodiscard]] std::string html_list(const std::string& title,
                                    const std::vector<std::string>& lines);

// caption is HTML; svg: of a plot.
[[nodiscard]] std::string html_figure(const std::string& caption, const std::string& svg);

}  // namespace alidade
