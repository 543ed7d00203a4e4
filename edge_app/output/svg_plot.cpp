#include "edge_app/output/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace alidade {
namespace {

constexpr std::size_t kMaxDots = 6000;

struct Ticks {
  std::vector<double> at;
  int decimals = 0;
};

// Two labels are enough to read an axis. If one of them may be in the middle, three are needed, so
// that there is one on either side.
constexpr std::size_t kFewestTicks = 3;

std::vector<double> multiples(double step, double low, double high) {
  std::vector<double> at;
  const double first = std::ceil(low / step - 1e-9);
  for (double n = first; n * step <= high + 1e-9 * step; n += 1) at.push_back(n * step);
  return at;
}

// About `wanted` round numbers from low to high, and never fewer than kFewestTicks.
Ticks round_ticks(double low, double high, int wanted) {
  const double rough = (high - low) / wanted;
  const double power = std::pow(10, std::floor(std::log10(rough)));
  Ticks ticks;
  for (const double factor : {10.0, 5.0, 2.0, 1.0, 0.5}) {
    const double step = factor * power;
    ticks.at = multiples(step, low, high);
    ticks.decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
    if (step < 2 * rough && ticks.at.size() >= kFewestTicks) break;
  }
  return ticks;
}

std::string tick_label(double value, int decimals) {
  constexpr int kMostDecimals = 5;  // the margin has no room for more
  const double unit = std::pow(10, decimals);
  std::string text = decimals > kMostDecimals ? fmt::format("{:g}", std::round(value * unit) / unit)
                                              : fmt::format("{:.{}f}", value, decimals);
  if (std::strtod(text.c_str(), nullptr) == 0 && text.front() == '-') text.erase(0, 1);
  if (text.front() == '-') text.replace(0, 1, "\u2212");
  return text;
}

}  // namespace

std::string escape_html(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

SvgPlot::SvgPlot(int width, int height, PlotAxis x, PlotAxis y, bool y_down)
    : width_(width), height_(height), x_(std::move(x)), y_(std::move(y)), y_down_(y_down) {}

double SvgPlot::x_scale() const { return (width_ - kLeft - kRight) / (x_.high - x_.low); }
double SvgPlot::y_scale() const { return (height_ - kTop - kBottom) / (y_.high - y_.low); }

double SvgPlot::px(double x) const { return kLeft + (x - x_.low) * x_scale(); }

double SvgPlot::py(double y) const {
  const double inside = std::clamp(y, y_.low, y_.high);
  return kTop + (y_down_ ? inside - y_.low : y_.high - inside) * y_scale();
}

void SvgPlot::dots(const std::vector<PlotPoint>& points, const char* colour, double diameter) {
  std::set<std::pair<int, int>> places;  // in half pixels
  for (const PlotPoint& point : points) {
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
    if (point.x < x_.low || point.x > x_.high) continue;
    places.emplace(static_cast<int>(std::lround(2 * px(point.x))),
                   static_cast<int>(std::lround(2 * py(point.y))));
  }
  if (places.empty()) return;
  has_data_ = true;
  const std::size_t stride = (places.size() + kMaxDots - 1) / kMaxDots;
  body_ += fmt::format("<path class=\"dots {}\" stroke-width=\"{}\" d=\"", colour, diameter);
  std::size_t i = 0;
  for (const auto& [x, y] : places) {
    if (i++ % stride == 0) body_ += fmt::format("M{} {}h0", x / 2.0, y / 2.0);
  }
  body_ += "\"/>\n";
}

void SvgPlot::line(const std::vector<PlotPoint>& points, const char* colour) {
  if (points.empty()) return;
  has_data_ = true;
  std::string path;
  for (const PlotPoint& point : points) {
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', px(point.x), py(point.y));
  }
  body_ += fmt::format("<path class=\"line {}\" d=\"{}\"/>\n", colour, path);
}

void SvgPlot::area(const std::vector<PlotPoint>& low, const std::vector<PlotPoint>& high,
                   const char* colour) {
  if (low.empty() || high.empty()) return;
  std::string path;
  const auto add = [&](const PlotPoint& point) {
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', px(point.x), py(point.y));
  };
  for (const PlotPoint& point : low) add(point);
  std::for_each(high.rbegin(), high.rend(), add);
  body_ += fmt::format("<path class=\"area {}\" fill-opacity=\".2\" d=\"{}Z\"/>\n", colour, path);
}

void SvgPlot::arrow(const PlotPoint& from, const PlotPoint& to) {
  body_ += fmt::format(
      "<path class=\"line ink\" d=\"M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}\"/>"
      "<path class=\"dots ink\" stroke-width=\"3.4\" d=\"M{0:.1f} {1:.1f}h0\"/>\n",
      px(from.x), py(from.y), px(to.x), py(to.y));
}

void SvgPlot::band(double low, double high) {
  const double top = std::min(py(low), py(high));
  body_ +=
      fmt::format("<rect class=\"band\" x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\"/>\n",
                  kLeft, top, width_ - kLeft - kRight, std::abs(py(low) - py(high)));
}

void SvgPlot::shade(double from, double to) {
  const double left = px(std::clamp(from, x_.low, x_.high));
  const double right = px(std::clamp(to, x_.low, x_.high));
  body_ +=
      fmt::format("<rect class=\"gap\" x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"{}\"/>\n",
                  left, kTop, right - left, height_ - kTop - kBottom);
}

void SvgPlot::level(double y) {
  body_ +=
      fmt::format("<path class=\"level\" d=\"M{} {:.1f}H{}\"/>\n", kLeft, py(y), width_ - kRight);
}

void SvgPlot::rectangle(const PlotPoint& from, const PlotPoint& to, const char* colour,
                        double opacity) {
  has_data_ = true;
  body_ += fmt::format(
      "<rect class=\"area {}\" fill-opacity=\"{:.2f}\" x=\"{:.1f}\" y=\"{:.1f}\" "
      "width=\"{:.1f}\" height=\"{:.1f}\"/>\n",
      colour, opacity, std::min(px(from.x), px(to.x)), std::min(py(from.y), py(to.y)),
      std::abs(px(to.x) - px(from.x)), std::abs(py(to.y) - py(from.y)));
}

void SvgPlot::ticks(const std::vector<double>& x, const char* colour) {
  body_ += fmt::format("<path class=\"line {}\" d=\"", colour);
  for (const double at : x) {
    if (at >= x_.low && at <= x_.high) {
      body_ += fmt::format("M{:.1f} {}v-7", px(at), height_ - kBottom);
    }
  }
  body_ += "\"/>\n";
}

std::string SvgPlot::axes() const {
  const int bottom = height_ - kBottom;
  const int right = width_ - kRight;
  std::string grid;
  std::string labels;
  const Ticks x = round_ticks(x_.low, x_.high, std::max(3, (right - kLeft) / 90));
  for (const double at : x.at) {
    grid += fmt::format("M{:.1f} {}V{}", px(at), kTop, bottom);
    labels += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>", px(at),
                          bottom + 16, tick_label(at, x.decimals));
  }
  const Ticks y = round_ticks(y_.low, y_.high, std::max(2, (bottom - kTop) / 34));
  for (const double at : y.at) {
    grid += fmt::format("M{} {:.1f}H{}", kLeft, py(at), right);
    labels += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", kLeft - 6,
                          py(at) + 4, tick_label(at, y.decimals));
  }
  labels += fmt::format("<text class=\"name\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                        (kLeft + right) / 2, height_ - 8, escape_html(x_.label));
  const int middle = (kTop + bottom) / 2;
  labels += fmt::format(
      "<text class=\"name\" x=\"14\" y=\"{0}\" text-anchor=\"middle\" "
      "transform=\"rotate(-90 14 {0})\">{1}</text>",
      middle, escape_html(y_.label));
  return fmt::format("<path class=\"grid\" d=\"{}\"/>\n{}\n", grid, labels);
}

std::string SvgPlot::svg(const std::string& label) const {
  const std::string nothing =
      has_data_ ? ""
                : fmt::format(
                      "<text class=\"name\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">no data"
                      "</text>\n",
                      (kLeft + width_ - kRight) / 2, (kTop + height_ - kBottom) / 2 - 8);
  return fmt::format(
      "<svg class=\"{9}\" viewBox=\"0 0 {0} {1}\" role=\"img\" aria-label=\"{2}\">\n{3}{4}{10}"
      "<path class=\"frame\" d=\"M{5} {6}V{7}H{8}\"/>\n</svg>\n",
      width_, height_, escape_html(label), axes(), body_, kLeft, kTop, height_ - kBottom,
      width_ - kRight, width_ >= kWide ? "wide" : "half", nothing);
}

}  // namespace alidade
