# SPDX-License-Identifier: Apache-2.0
# Doxygen's input filter: <word> in a documentation comment is a word (of URDF, of a page), not HTML.
use strict;
use warnings;
while (my $line = <>) {
  if ($line =~ m{^(.*?///<?)(.*)$}s) {
    my ($before, $comment) = ($1, $2);
    my @parts = split /(`[^`]*`)/, $comment;
    for (@parts) {
      s{<(?=/?[A-Za-z_])}{&lt;}g unless /^`/;
    }
    $line = $before . join('', @parts);
  }
  print $line;
}
