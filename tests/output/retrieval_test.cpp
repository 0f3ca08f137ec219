// Least squares against textbooks: what data tell, how well, and what they cannot.
#include "output/retrieval.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

namespace twilight {
namespace {

// y = a + b x at x = 0..n-1, of standard error s.
RetrievalProblem straight_line(int n, double a, double b, double s) {
  RetrievalProblem problem;
  problem.parameters = {{"a", -10, 10, 0, false}, {"b", -5, 5, 0, false}};
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int x = 0; x < n; ++x) {
    problem.measured.push_back(a + b * x + s * normal(random));
    problem.standard_error.push_back(s);
  }
  problem.model = [n](std::span<const double> p) {
    std::vector<double> y;
    for (int x = 0; x < n; ++x) y.push_back(p[0] + p[1] * x);
    return y;
  };
  return problem;
}

// Least squares of a straight line, errors and covariance (Bevington & Robinson 2003, Sec. 6.3 and
// 6.4): Delta = n Sxx - Sx^2, var a = s^2 Sxx / Delta, var b = s^2 n / Delta,
// cov = -s^2 Sx / Delta.
TEST(Retrieval, GivesTheTextbookCovarianceOfAStraightLine) {
  constexpr int kN = 12;
  constexpr double kS = 0.3;
  const RetrievalProblem problem = straight_line(kN, 1.0, 0.5, kS);
  const Retrieval r = retrieve(problem, {});
  ASSERT_TRUE(r.converged);
  double sx = 0, sxx = 0, sy = 0, sxy = 0;
  for (int x = 0; x < kN; ++x) {
    const double y = problem.measured[static_cast<std::size_t>(x)];
    sx += x, sxx += x * x, sy += y, sxy += x * y;
  }
  const double delta = kN * sxx - sx * sx;
  // A search ends where a step lowers chi squared (about 10) by less than 1e-4 of it: sqrt(1e-3),
  // three hundredths of an error, from the minimum at most.
  EXPECT_NEAR(r.parameters[0].value, (sxx * sy - sx * sxy) / delta,
              0.03 * r.parameters[0].standard_error);
  EXPECT_NEAR(r.parameters[1].value, (kN * sxy - sx * sy) / delta,
              0.03 * r.parameters[1].standard_error);
  const double f = kS * kS * r.error_scale * r.error_scale / delta;
  EXPECT_NEAR(r.covariance[0][0], f * sxx, 1e-6 * f * sxx);
  EXPECT_NEAR(r.covariance[1][1], f * kN, 1e-6 * f * kN);
  EXPECT_NEAR(r.covariance[0][1], -f * sx, 1e-6 * f * sx);
  EXPECT_NEAR(r.correlation[0][1], -sx / std::sqrt(kN * sxx), 1e-6);
  EXPECT_NEAR(r.parameters[0].high_95 - r.parameters[0].low_95,
              2 * 1.959964 * r.parameters[0].standard_error, 1e-5);
  EXPECT_EQ(r.degrees_of_freedom, 10u);
}

TEST(Retrieval, ErrorsGrowWhereTheModelDoesNotExplainTheData) {
  RetrievalProblem problem = straight_line(40, 1.0, 0.5, 0.3);
  const Retrieval honest = retrieve(problem, {});
  for (double& s : problem.standard_error) s /= 5;
  const Retrieval boastful = retrieve(problem, {});
  EXPECT_GT(boastful.error_scale, 3.0);
  // Errors a fifth as large, scaled to what the scatter says: about the same.
  EXPECT_NEAR(boastful.parameters[1].standard_error / honest.parameters[1].standard_error,
              boastful.error_scale / honest.error_scale / 5, 1e-6);
}

// A logarithmic parameter's error is that of its logarithm times its value.
TEST(Retrieval, SearchesOverDecadesInTheLogarithm) {
  RetrievalProblem problem;
  problem.parameters = {{"k", 1e-3, 1e3, 1e2, true}};
  constexpr double kTruth = 0.05, kError = 1e-3;
  for (int x = 1; x <= 6; ++x) {
    problem.measured.push_back(std::exp(-kTruth * x));
    problem.standard_error.push_back(kError);
  }
  problem.model = [](std::span<const double> p) {
    std::vector<double> y;
    for (int x = 1; x <= 6; ++x) y.push_back(std::exp(-p[0] * x));
    return y;
  };
  RetrievalOptions options;
  options.difference_step = 1e-4;
  const Retrieval r = retrieve(problem, options);
  EXPECT_NEAR(r.parameters[0].value, kTruth, 1e-5);
  double information = 0;
  for (int x = 1; x <= 6; ++x) information += std::pow(x * std::exp(-kTruth * x) / kError, 2);
  EXPECT_NEAR(r.parameters[0].standard_error, 1 / std::sqrt(information), 1e-6);
  EXPECT_TRUE(r.parameters[0].claimed);
}

TEST(Retrieval, DoesNotClaimWhatHasNoEffect) {
  RetrievalProblem problem = straight_line(12, 1.0, 0.5, 0.1);
  problem.parameters.push_back({"c", 0, 1, 0.3, false});
  const Retrieval r = retrieve(problem, {});
  EXPECT_TRUE(r.parameters[0].claimed);
  EXPECT_TRUE(r.parameters[1].claimed);
  EXPECT_FALSE(r.parameters[2].claimed);
  EXPECT_TRUE(std::isinf(r.parameters[2].standard_error));
  EXPECT_THAT(r.parameters[2].reasons, testing::Contains(testing::HasSubstr("no effect")));
}

// The data know a + b alone.
TEST(Retrieval, NamesParametersThatTradeOff) {
  RetrievalProblem problem;
  problem.parameters = {{"a", 0, 1, 0.3, false}, {"b", 0, 1, 0.3, false}, {"c", 0, 1, 0.5, false}};
  for (int x = 0; x < 8; ++x) {
    problem.measured.push_back(0.8 + 0.4 * x);
    problem.standard_error.push_back(0.01);
  }
  problem.model = [](std::span<const double> p) {
    std::vector<double> y;
    for (int x = 0; x < 8; ++x) y.push_back(p[0] + p[1] * (1 + 1e-4 * x * x) + p[2] * x);
    return y;
  };
  const Retrieval r = retrieve(problem, {});
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_FALSE(r.parameters[i].claimed);
    ASSERT_FALSE(r.parameters[i].trades_off_with.empty());
    EXPECT_EQ(r.parameters[i].trades_off_with.front().first, i == 0 ? "b" : "a");
    EXPECT_LT(r.parameters[i].trades_off_with.front().second, -kTradeOff);
  }
  EXPECT_TRUE(r.parameters[2].claimed);
  EXPECT_NEAR(r.parameters[2].value, 0.4, 0.01);
}

// A profile's interval is the linearised one where the model is linear.
TEST(Retrieval, ProfilesOfALinearModelAreItsErrors) {
  RetrievalProblem problem = straight_line(12, 1.0, 0.5, 4.0);
  RetrievalOptions options;
  options.profiles = false;
  const Retrieval linear = retrieve(problem, options);
  options.profiles = true;
  const Retrieval profiled = retrieve(problem, options);
  for (const std::size_t i : {0u, 1u}) {
    const double error = linear.parameters[i].standard_error;
    ASSERT_TRUE(profiled.parameters[i].profiled);
    EXPECT_NEAR(profiled.parameters[i].low_95, linear.parameters[i].low_95, 0.1 * error);
    EXPECT_NEAR(profiled.parameters[i].high_95, linear.parameters[i].high_95, 0.1 * error);
  }
}

// q = p^8 measured as 0.9 +- 0.3: steep at the best, flat below, where p may be down to
// (0.9 - 1.96 0.3 / sqrt 2)^(1/8).
TEST(Retrieval, ProfilesFollowACurvedModel) {
  RetrievalProblem problem;
  problem.parameters = {{"p", 0, 1.2, 0.8, false}};
  problem.measured = {0.9, 0.9};
  problem.standard_error = {0.3, 0.3};
  problem.model = [](std::span<const double> p) {
    return std::vector<double>(2, std::pow(p[0], 8));
  };
  const Retrieval r = retrieve(problem, {});
  const double half = 1.959964 * 0.3 / std::sqrt(2.0);
  EXPECT_TRUE(r.parameters[0].profiled);
  EXPECT_NEAR(r.parameters[0].low_95, std::pow(0.9 - half, 0.125), 0.01);
  EXPECT_NEAR(r.parameters[0].high_95, std::pow(0.9 + half, 0.125), 0.01);
}

// (p - 1/2)^2 tells p but for its mirror image: the linearised error is small, the other end of the
// range fits as well.
TEST(Retrieval, ProfilesSeeWhatTheLinearisedErrorDoesNot) {
  RetrievalProblem problem;
  problem.parameters = {{"p", 0, 1, 0.98, false}};
  problem.measured = {0.25, 0.25, 0.25};
  problem.standard_error = {0.02, 0.02, 0.02};
  problem.model = [](std::span<const double> p) {
    return std::vector<double>(3, (p[0] - 0.5) * (p[0] - 0.5));
  };
  RetrievalOptions options;
  options.starts = 1;
  options.profiles = false;
  EXPECT_TRUE(retrieve(problem, options).parameters[0].claimed);
  options.profiles = true;
  problem.standard_error.assign(3, 0.05);
  const Retrieval r = retrieve(problem, options);
  EXPECT_FALSE(r.parameters[0].claimed);
  ASSERT_TRUE(r.parameters[0].low_end.has_value());
  EXPECT_LT(r.parameters[0].low_end->rise, kProfileRise);
}

TEST(Retrieval, StaysWithinTheRanges) {
  RetrievalProblem problem = straight_line(12, 1.0, 0.5, 0.1);
  problem.parameters[1].high = 0.3;  // the truth is outside
  RetrievalProblem watched = problem;
  watched.model = [&](std::span<const double> p) {
    EXPECT_GE(p[0], -10.0);
    EXPECT_LE(p[0], 10.0);
    EXPECT_GE(p[1], -5.0);
    EXPECT_LE(p[1], 0.3);
    return problem.model(p);
  };
  const Retrieval r = retrieve(watched, {});
  EXPECT_DOUBLE_EQ(r.parameters[1].value, 0.3);
  EXPECT_EQ(r.parameters[1].bound_hit, "highest");
}

// Several starts find the deeper of two minima of (x^2 - 1)^2 + (x + 1)^2 / 4 about x = -1.
TEST(Retrieval, SeveralStartsFindTheDeeperMinimum) {
  RetrievalProblem problem;
  problem.parameters = {{"x", -2, 2, 1.5, false}};
  problem.measured = {0, 0};
  problem.standard_error = {1, 1};
  problem.model = [](std::span<const double> p) {
    return std::vector<double>{10 * (p[0] * p[0] - 1), (p[0] + 1) / 2};
  };
  const Retrieval r = retrieve(problem, {});
  EXPECT_NEAR(r.parameters[0].value, -1.0, 1e-3);
  EXPECT_GT(r.starts.size(), 1u);
  EXPECT_GT(r.best_start, 0u);
  EXPECT_GT(r.starts.front().chi_squared, r.chi_squared + 0.5);
}

// The same minima, one start in the higher one's valley, and errors so wide that profiles look
// about: they end below the best, and the search goes on from there.
TEST(Retrieval, AProfileBelowTheBestIsSearchedFrom) {
  RetrievalProblem problem;
  problem.parameters = {{"x", -2, 2, 1.5, false}, {"y", -1, 1, 0.5, false}};
  problem.measured = {0, 0, 0};
  problem.standard_error = {1, 1, 1};
  problem.model = [](std::span<const double> p) {
    return std::vector<double>{4 * (p[0] * p[0] - 1), (p[0] + 1) * 1.5, 20 * (p[1] - p[0] / 4)};
  };
  RetrievalOptions options;
  options.starts = 1;
  options.profiles = false;
  const Retrieval local = retrieve(problem, options);
  EXPECT_GT(local.parameters[0].value, 0.5);
  options.profiles = true;
  for (const bool accurate : {false, true}) {
    if (accurate) problem.accurate_model = problem.model;
    const Retrieval r = retrieve(problem, options);
    EXPECT_TRUE(r.converged);
    EXPECT_NEAR(r.parameters[0].value, -1.0, 1e-2);
    EXPECT_NEAR(r.parameters[1].value, -0.25, 1e-2);
    EXPECT_LT(r.chi_squared, 0.01);
    EXPECT_LT(r.parameters[0].high_95, 0.0);
    ASSERT_GE(r.starts.size(), 2u);
    EXPECT_EQ(r.best_start, r.starts.size() - 1);
    EXPECT_GT(r.starts.front().chi_squared, r.chi_squared);
  }
}

// The search's model has a lower minimum that the accurate one has not: the best stays.
TEST(Retrieval, AProfileIsNotFollowedToWhereTheAccurateModelIsHigher) {
  RetrievalProblem problem;
  problem.parameters = {{"x", -2, 2, 1.5, false}, {"y", -1, 1, 0.5, false}};
  problem.measured = {0, 0, 0, 0};
  problem.standard_error = {1, 1, 1, 1};
  problem.model = [](std::span<const double> p) {
    return std::vector<double>{4 * (p[0] * p[0] - 1), (p[0] + 1) * 1.5, 20 * (p[1] - p[0] / 4), 0};
  };
  problem.accurate_model = [&](std::span<const double> p) {
    std::vector<double> y = problem.model(p);
    y[3] = p[0] < 0 ? 9 : 0;
    return y;
  };
  RetrievalOptions options;
  options.starts = 1;
  const Retrieval r = retrieve(problem, options);
  EXPECT_GT(r.parameters[0].value, 0.5);
  EXPECT_LT(r.chi_squared, 10.0);
  EXPECT_EQ(r.best_start, 0u);
  EXPECT_EQ(r.starts.size(), 2u);
  EXPECT_NEAR(r.predicted[3], 0.0, 1e-12);
}

// A model that misses the data by many errors tells nothing of the air, however sharp its minimum.
TEST(Retrieval, ClaimsNothingOfAModelThatDoesNotExplainTheData) {
  RetrievalProblem problem = straight_line(40, 1.0, 0.5, 1e-3);
  ASSERT_TRUE(retrieve(problem, {}).parameters[1].claimed);
  for (std::size_t k = 0; k < problem.measured.size(); ++k) {
    problem.measured[k] += k % 2 == 0 ? 0.01 : -0.01;
  }
  const Retrieval r = retrieve(problem, {});
  EXPECT_GT(r.error_scale, 9.0);
  for (const RetrievedParameter& p : r.parameters) {
    EXPECT_FALSE(p.claimed);
    EXPECT_THAT(p.reasons, testing::Contains(testing::HasSubstr("does not explain")));
  }
}

// The search's model is biased; the accurate one has the last word.
TEST(Retrieval, EndsAtTheAccurateModelsMinimum) {
  RetrievalProblem problem = straight_line(12, 1.0, 0.5, 0.05);
  problem.accurate_model = problem.model;
  const Retrieval exact = retrieve(problem, {});
  const ForwardModel line = problem.model;
  problem.model = [line](std::span<const double> p) {
    std::vector<double> y = line(p);
    for (std::size_t k = 0; k < y.size(); ++k)
      y[k] *= 1.05 + 0.005 * static_cast<double>(k) + 0.01 * p[0];
    return y;
  };
  const Retrieval r = retrieve(problem, {});
  EXPECT_TRUE(r.converged);
  EXPECT_GT(r.correction_shift_sigma, 1.0);
  for (const std::size_t i : {0u, 1u}) {
    EXPECT_NEAR(r.parameters[i].value, exact.parameters[i].value,
                0.1 * exact.parameters[i].standard_error);
  }
}

TEST(Retrieval, SameSeedSameResult) {
  const RetrievalProblem problem = straight_line(12, 1.0, 0.5, 0.3);
  const Retrieval a = retrieve(problem, {}), b = retrieve(problem, {});
  EXPECT_EQ(a.predicted, b.predicted);
  EXPECT_EQ(a.covariance, b.covariance);
}

TEST(Retrieval, RefusesWhatIsNoProblem) {
  RetrievalProblem few = straight_line(1, 1.0, 0.5, 0.3);
  EXPECT_THROW(retrieve(few, {}), std::invalid_argument);
  RetrievalProblem error = straight_line(12, 1.0, 0.5, 0.3);
  error.standard_error[3] = 0;
  EXPECT_THROW(retrieve(error, {}), std::invalid_argument);
  RetrievalProblem range = straight_line(12, 1.0, 0.5, 0.3);
  range.parameters[0].start = 11;
  EXPECT_THROW(retrieve(range, {}), std::invalid_argument);
}

TEST(Retrieval, WhatTheModelThrowsComesOut) {
  RetrievalProblem problem = straight_line(12, 1.0, 0.5, 0.3);
  int calls = 0;
  const ForwardModel line = problem.model;
  problem.model = [&calls, line](std::span<const double> p) {
    if (++calls > 4) throw Cancelled();
    return line(p);
  };
  EXPECT_THROW(retrieve(problem, {}), Cancelled);
}

}  // namespace
}  // namespace twilight
