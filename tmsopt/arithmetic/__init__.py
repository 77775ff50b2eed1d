"""One formula for floats, arrays, CasADi expressions, fractions, balls; interval Newton."""
